// IMU integration and how it carries the error along. Derivation: docs/filter.md, section 2.
#pragma once

#include <Eigen/Core>

#include "ear/calibration.h"
#include "filter/state.h"

namespace ear {

using ImuErrorMatrix = Eigen::Matrix<double, err::imu_size, err::imu_size>;

/// An error over an interval: x_end = Phi x_start + w, cov(w) = Q. Intervals chain.
struct ErrorTransition {
  ImuErrorMatrix Phi = ImuErrorMatrix::Identity();
  ImuErrorMatrix Q = ImuErrorMatrix::Zero();
};

/// The state `dt` seconds on, with body-frame rate [rad/s] and specific force [m/s^2] constant meanwhile. Biases are
/// those of the state. Exact for constant inputs.
[[nodiscard]] ImuState integrate(const ImuState& x, const Eigen::Vector3d& gyro_B, const Eigen::Vector3d& accel_B,
                                 double dt);

/// How the error of `x` goes over into that of integrate(x, ...), and the noise that comes in on the way.
[[nodiscard]] ErrorTransition error_transition(const ImuState& x, const Eigen::Vector3d& gyro_B,
                                               const Eigen::Vector3d& accel_B, double dt, const ImuCalibration& noise);

/// `total` followed by `step`.
void chain(ErrorTransition& total, const ErrorTransition& step);

}  // namespace ear
