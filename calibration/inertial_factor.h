// The residual of the inertial samples between two keyframes, with the gyroscope's errors.
#pragma once

#include <ceres/sized_cost_function.h>

#include "calibration/inertial_path.h"
#include "smoother/imu_factor.h"

namespace ear::calibration {

/// The smoother's, with a fifth block: GyroErrors, to first order about those that the samples were taken with.
class InertialFactor final : public ceres::SizedCostFunction<smoother::imu_error::size, 7, 9, 7, 9, 9> {
 public:
  explicit InertialFactor(const Preintegrated& measured);
  bool Evaluate(double const* const* blocks, double* residual, double** jacobians) const override;

 private:
  smoother::ImuFactor exact_;
  GyroErrors at_;
  Eigen::Matrix<double, smoother::imu_error::size, 9> J_gyro_;  ///< of the residual
};

}  // namespace ear::calibration
