// A vehicle that stands: where it was at frame i, and without velocity. The filter's standstill update.
#pragma once

#include <ceres/sized_cost_function.h>

#include "ear/filter_config.h"
#include "smoother/blocks.h"

namespace ear::smoother {

/// Blocks: pose at i, pose and motion at j. Whitened: Log(R_i^T R_j), R_i^T (p_j - p_i), v_j.
class StandstillFactor final : public ceres::SizedCostFunction<9, 7, 7, 9> {
 public:
  explicit StandstillFactor(const StandstillConfig& config);
  bool Evaluate(double const* const* blocks, double* residual, double** jacobians) const override;

 private:
  Eigen::Matrix<double, 9, 1> weight_;
};

}  // namespace ear::smoother
