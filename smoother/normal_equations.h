// Factors summed up around the present values of their blocks, as the normal equations H step = -b of the steps. What
// Ceres keeps to itself, for the covariance and for making a prior of what goes out of the window.
#pragma once

#include <Eigen/Core>
#include <unordered_map>
#include <vector>

#include "smoother/factor.h"
#include "smoother/prior_factor.h"

namespace ear::smoother {

class NormalEquations {
 public:
  /// The blocks that stay as unknowns, in this order; blocks of factors that are not among them are constants.
  explicit NormalEquations(const std::vector<PriorBlock>& blocks);

  /// Robust losses count as weights at the present residual. Factors that cannot be evaluated are left out.
  void add(const Factor& factor);

  /// All factors of one point, which is eliminated.
  void add_point(const std::vector<const Factor*>& factors, const double* point);

  [[nodiscard]] int size() const { return static_cast<int>(b_.size()); }
  /// First entry of a block; -1 if it is none of the unknowns.
  [[nodiscard]] int column(const double* block) const;
  [[nodiscard]] Eigen::MatrixXd H() const { return H_.selfadjointView<Eigen::Lower>(); }  ///< sum of J^T J
  [[nodiscard]] const Eigen::VectorXd& b() const { return b_; }                           ///< sum of J^T r

 private:
  struct Term {
    int column = 0;
    int size = 0;
    Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor> J;
  };
  bool linearize(const Factor& factor, const double* point);
  void sum_up();

  std::unordered_map<const double*, std::pair<int, int>> columns_;  // of a block: first, and size of its step
  Eigen::MatrixXd H_;                                               // lower triangle
  Eigen::VectorXd b_;
  Eigen::VectorXd residual_;  // of the factor at hand
  std::vector<Term> terms_;   // the first term_count_ are its own
  std::size_t term_count_ = 0;
  Eigen::Matrix<double, Eigen::Dynamic, 3, Eigen::RowMajor> J_point_;
  Eigen::Matrix<double, Eigen::Dynamic, 3> W_;  // J^T J_point of the point at hand
};

/// What `factors` and `points` show of `kept`, `removed` eliminated; as a factor of the blocks in `kept`, in that
/// order. The values in both lists are the present ones. Nothing if it is not finite.
struct PointFactors {
  std::vector<const Factor*> factors;
  const double* point = nullptr;
};
[[nodiscard]] std::unique_ptr<PriorFactor> marginalize(const std::vector<const Factor*>& factors,
                                                       const std::vector<PointFactors>& points,
                                                       const std::vector<PriorBlock>& removed,
                                                       const std::vector<PriorBlock>& kept);

}  // namespace ear::smoother
