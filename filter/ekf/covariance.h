// The covariance of the error, behind one small interface, so that another form of it can take its place.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "filter/ekf/propagation.h"
#include "filter/kernels/filter_kernels.h"

namespace ear {

/// Symmetric matrix of the error vector (state.h). All memory is taken at construction.
class Covariance {
 public:
  /// `capacity`: the largest error vector that will ever be. All kernels give the same bits.
  explicit Covariance(int capacity, Kernels kernels = Kernels::best);

  /// Diagonal matrix of `size` standard deviations squared.
  void reset(const Eigen::VectorXd& sigma);

  [[nodiscard]] int size() const { return size_; }
  [[nodiscard]] Eigen::Block<const Eigen::MatrixXd> matrix() const { return P_.topLeftCorner(size_, size_); }

  /// The inertial part moves on; all else stays where it is in the world. So does the ground's normal, whose error is
  /// counted from that of the body's rotation; `B`: its tangent basis. `normal_variance` [rad^2]: what the ground may
  /// have turned meanwhile, each axis.
  void propagate(const ErrorTransition& transition, const Eigen::Matrix<double, 3, 2>& B, double normal_variance);

  /// Makes the `sigma.size()` entries from `first` on unknown anew: these standard deviations, no correlations.
  void restart(int first, const Eigen::Ref<const Eigen::VectorXd>& sigma);

  /// Adds an independent error of covariance Q to the Q.rows() entries from `first` on.
  void inflate(int first, const Eigen::Ref<const Eigen::MatrixXd>& Q);

  /// Variance of the row h of the entries from `first_column` on.
  template <typename Row>
  [[nodiscard]] double variance(const Eigen::MatrixBase<Row>& h, int first_column) const {
    const typename Row::PlainObject row = h;  // next to each other; those of a matrix's row are not
    return variance_of_row(row, first_column);
  }

  /// Appends J * error, J: 6 x size. Only the columns of the inertial part and of the time offset are used: a clone is
  /// taken where the vehicle is now.
  void append_clone(const Eigen::Matrix<double, 6, err::imu_size>& J_clone_imu,
                    const Eigen::Matrix<double, 6, 1>& J_clone_offset);

  /// Forgets `count` entries from `first` on.
  void remove(int first, int count);

  /// Update by whitened rows: residual = H * error(first_column ... first_column + H.cols()) + n, cov(n) = I.
  /// The `considered` range (first, count) keeps its value and variance, its uncertainty counts (Schmidt-Kalman).
  /// Returns the correction to apply with boxplus, zero in the considered range; valid until the next call. Rows that
  /// are not numbers change nothing and return zeros.
  Eigen::Ref<const Eigen::VectorXd> update(const Eigen::Ref<const Eigen::MatrixXd>& H, int first_column,
                                           const Eigen::Ref<const Eigen::VectorXd>& residual, int considered_first = 0,
                                           int considered_count = 0);

 private:
  [[nodiscard]] double variance_of_row(const Eigen::Ref<const Eigen::RowVectorXd>& h, int first_column) const;

  FilterKernels kernels_;
  Eigen::MatrixXd P_;  ///< with rows and columns beyond `capacity`, for the kernels
  int size_ = 0;
  Eigen::MatrixXd Ht_, PHt_, S_, considered_;
  Eigen::VectorXd whitened_, correction_;
  std::vector<int> seen_;  ///< columns of H that are not zero
};

}  // namespace ear
