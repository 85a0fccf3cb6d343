// The residual of the inertial samples between two frames: (1)'s r_I.
#pragma once

#include <ceres/sized_cost_function.h>

#include "smoother/blocks.h"
#include "smoother/imu_preintegration.h"

namespace ear::smoother {

/// Blocks: pose and motion at i, pose and motion at j. In the order of imu_error, predicted by the states less
/// measured, whitened:
///   xi = Log(R_i^T R_j R_BiBj^T), dv = R_i^T (v_j - v_i - g T) - dv_Bi, dp = R_i^T (p_j - p_i - v_i T - g T^2 / 2) -
///   dp_Bi
class ImuFactor final : public ceres::SizedCostFunction<imu_error::size, 7, 9, 7, 9> {
 public:
  explicit ImuFactor(const ImuPreintegration& measured);
  bool Evaluate(double const* const* blocks, double* residual, double** jacobians) const override;
  /// What the residual, in the order of imu_error, is multiplied with.
  [[nodiscard]] const Eigen::Matrix<double, imu_error::size, imu_error::size>& whitening() const { return whitening_; }

 private:
  ImuPreintegration measured_;
  Eigen::Matrix<double, imu_error::size, imu_error::size> whitening_;
};

}  // namespace ear::smoother
