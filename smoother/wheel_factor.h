// The residual of the terrain-aware odometer between two frames: the paper's (12), first row. The rotation and the
// bias, its other two rows, are those of the same gyroscope and are in ImuFactor already.
#pragma once

#include <ceres/sized_cost_function.h>

#include "smoother/blocks.h"
#include "smoother/wheel_preintegration.h"

namespace ear::smoother {

/// The odometer as calibrated, with the relative errors of a wheels block.
[[nodiscard]] OdometerState with_errors(const OdometerState& given, const double* wheels);

/// Blocks: pose and motion at i, pose at j, wheels. Measured less predicted, whitened [m]:
///   alpha_Bi - R_i^T (p_WOj - p_WOi)
class WheelFactor final : public ceres::SizedCostFunction<3, 7, 9, 7, 6> {
 public:
  /// `given`: the calibration that the wheels block is relative to. `covariance` of alpha [m^2].
  WheelFactor(const WheelDisplacement& measured, const OdometerState& given, const Eigen::Matrix3d& covariance);
  bool Evaluate(double const* const* blocks, double* residual, double** jacobians) const override;

 private:
  WheelDisplacement measured_;
  OdometerState given_;
  Eigen::Matrix3d whitening_;
};

}  // namespace ear::smoother
