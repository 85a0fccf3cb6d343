// The covariance of the error, and what propagation, clones and updates do to it.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "filter/ekf/propagation.h"
#include "filter/kernels/filter_kernels.h"

namespace ear {

/// Covariance of the poses of one clone with those of another.
using ClonePair = Eigen::Matrix<double, err::clone_size, err::clone_size>;

/// A point that does not move in the frame of a clone, whose error begins at `entry`.
struct ClonePoint {
  int entry = 0;
  Eigen::Vector3d p_W = Eigen::Vector3d::Zero();
};

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
  /// counted from that of the body's rotation; `B`: its tangent basis. `by_matrix`: what errors of the
  /// inertial sensors' matrices do meanwhile. `normal_variance` [rad^2]: what the ground may have turned, each axis.
  void propagate(const ErrorTransition& transition, const MatrixEffect& by_matrix, const Eigen::Matrix<double, 3, 2>& B,
                 double normal_variance);

  /// Makes the `sigma.size()` entries from `first` on unknown anew: these standard deviations, no correlations.
  void restart(int first, const Eigen::Ref<const Eigen::VectorXd>& sigma);

  /// Adds an independent error of covariance Q to the Q.rows() entries from `first` on.
  void inflate(int first, const Eigen::Ref<const Eigen::MatrixXd>& Q);
  /// For size() numbers, up to the next update.
  [[nodiscard]] Eigen::Ref<Eigen::VectorXd> room() { return correction_.head(size_); }
  /// Adds J times one independent unknown of standard deviation 1; J has size() entries.
  void inflate_along(const Eigen::Ref<const Eigen::VectorXd>& J);

  /// Variance of the row h of the entries from `first_column` on.
  [[nodiscard]] double variance(const Eigen::Ref<const Eigen::RowVectorXd>& h, int first_column) const;

  /// Appends a clone of theta and rho: it is taken where the vehicle is now. `J_offset`: how it moves by an error of
  /// the time offset.
  void append_clone(const Eigen::Matrix<double, 6, 1>& J_offset);

  /// All positions are counted from where the vehicle is now, `p_W` from the origin so far: its own is known then.
  void move_origin(const Eigen::Vector3d& p_W);

  /// Forgets `count` entries from `first` on.
  void remove(int first, int count);

  /// Update by whitened rows: residual = H * error(first_column ... first_column + H.cols()) + n, cov(n) = I.
  /// The `considered` range (first, count) keeps its value and variance, its uncertainty counts (Schmidt-Kalman).
  /// Returns the correction to apply with boxplus, zero in the considered range; valid until the next call. Rows that
  /// are not numbers change nothing and return zeros.
  Eigen::Ref<const Eigen::VectorXd> update(const Eigen::Ref<const Eigen::MatrixXd>& H, int first_column,
                                           const Eigen::Ref<const Eigen::VectorXd>& residual, int considered_first = 0,
                                           int considered_count = 0);
  /// What update() would return. The covariance stays.
  Eigen::Ref<const Eigen::VectorXd> correction(const Eigen::Ref<const Eigen::MatrixXd>& H, int first_column,
                                               const Eigen::Ref<const Eigen::VectorXd>& residual,
                                               int considered_first = 0, int considered_count = 0);
  /// What update() with the rows of the last correction() would leave of two clones, which begin at `row` and `column`.
  [[nodiscard]] ClonePair corrected(int row, int column) const;
  /// Of the way from one point to another, in W [m^2]; `after`: what such an update would leave of it.
  [[nodiscard]] Eigen::Matrix3d of_way(const ClonePoint& from, const ClonePoint& to, bool after = false) const;

 private:
  FilterKernels kernels_;
  Eigen::MatrixXd P_;  ///< with rows and columns beyond `capacity`, for the kernels
  int size_ = 0;
  int rows_ = 0;  ///< of the last correction(), if it could be computed
  Eigen::MatrixXd Ht_, PHt_, S_, considered_;
  Eigen::VectorXd whitened_, correction_;
  std::vector<int> seen_;  ///< columns of H that are not zero
};

}  // namespace ear
