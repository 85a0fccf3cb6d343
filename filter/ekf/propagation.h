// IMU integration and how it carries the error along. Derivation: docs/filter.md, "Propagation".
#pragma once

#include <Eigen/Core>

#include "ear/calibration.h"
#include "ear/estimate.h"
#include "filter/ekf/state.h"
#include "filter/ingest/imu_buffer.h"
#include "filter/kernels/filter_kernels.h"

namespace ear {

using ImuErrorMatrix = Eigen::Matrix<double, err::imu_size, err::imu_size>;

/// An error over an interval: x_end = Phi x_start + w, cov(w) = Q. Intervals chain. Of Phi only the blocks that
/// FilterKernels::carry() looks at differ from those of the identity matrix.
struct ErrorTransition {
  ImuErrorMatrix Phi = ImuErrorMatrix::Identity();
  ImuErrorMatrix Q = ImuErrorMatrix::Zero();
};

/// The state `dt` seconds on, with body-frame rate [rad/s] and specific force [m/s^2] constant meanwhile. Biases are
/// those of the state. Exact for constant inputs.
[[nodiscard]] ImuState integrate(const ImuState& x, const Eigen::Vector3d& gyro_B, const Eigen::Vector3d& accel_B,
                                 double dt);

/// The state at `t_ns`, carried there by the samples; as it is if that is not later.
[[nodiscard]] ImuState integrate_to(TimeNs t_ns, ImuState x, const ImuBuffer& samples);

/// Attitude and velocity at a time.
struct BodyMotion {
  Eigen::Matrix3d R_WB;
  Eigen::Vector3d v_W;
};
/// At `t_ns`, taken back there by the samples if the state `x` has passed it; else those of the state.
[[nodiscard]] BodyMotion motion_at(TimeNs t_ns, const ImuState& x, const ImuBuffer& samples);

/// What the velocity of motion_at() is less certain by than that of the state [m/s], `delay` seconds later, which is
/// tilted by `tilt` [rad], a standard deviation: it takes that part of gravity along.
[[nodiscard]] double taken_back_sigma(double tilt, double delay);

/// The rotation from one time to another, earlier or later, by the gyroscope, its bias `b_g` removed: R_B0B1.
[[nodiscard]] Eigen::Matrix3d gyro_rotation(TimeNs from_ns, TimeNs to_ns, const Eigen::Vector3d& b_g,
                                            const ImuBuffer& samples);

/// The state as users get it.
[[nodiscard]] NavState nav_state(const ImuState& x);

/// How the error of `x` goes over into that of integrate(x, ...), and the noise that comes in meanwhile.
[[nodiscard]] ErrorTransition error_transition(const ImuState& x, const Eigen::Vector3d& gyro_B,
                                               const Eigen::Vector3d& accel_B, double dt, const ImuCalibration& noise);

/// The noise of samples that are less certain than usual.
[[nodiscard]] inline ImuCalibration with_factors(ImuCalibration imu, const ImuNoiseFactors& factors) {
  imu.gyro_noise *= factors.gyro;
  imu.accel_noise *= factors.accel;
  return imu;
}

/// `total` followed by `step`.
void chain(const FilterKernels& kernels, ErrorTransition& total, const ErrorTransition& step);

/// What errors of the gyroscope's matrix do to (theta, nu, rho), and of the accelerometer's to (nu, rho).
using GyroEffect = Eigen::Matrix<double, 9, 9>;
using AccelEffect = Eigen::Matrix<double, 6, 9>;
struct MatrixEffect {
  GyroEffect gyro = GyroEffect::Zero();
  AccelEffect accel = AccelEffect::Zero();
};

/// `total` followed by `step`, in which the sensor measures `measured_B` without its bias [rad/s; m/s^2].
void chain(GyroEffect& total, const ErrorTransition& step, const Eigen::Vector3d& measured_B);
void chain(AccelEffect& total, const ErrorTransition& step, const Eigen::Vector3d& measured_B);
/// Without the turn about the vertical that there is in the effect, which has just come to `x`.
void leave_out_heading(GyroEffect& effect, const ImuState& x);

}  // namespace ear
