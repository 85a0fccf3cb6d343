// An estimate as MAVLink's ODOMETRY: other axes, the twist in the vehicle's frame, covariances to match.
// Derivation: docs/mavlink.md, "Frames" and "Covariances".
#pragma once

#include <Eigen/Core>

#include "ear/calibration.h"
#include "ear/estimate.h"
#include "src/mavlink/messages.h"

namespace ear::mavlink {

using EstimateCovariance = Eigen::Matrix<double, estimate_error::size, estimate_error::size>;

/// Rotation of the vehicle V (x forward, y right, z down) to the body from the odometer's pose in the body.
[[nodiscard]] Eigen::Matrix3d mounting_of(const EncoderCalibration& encoder);

/// The same from how the IMU sits in the vehicle: turned from the vehicle's x forward, y left, z up by `yaw` about z,
/// then by `pitch` about the new y, then by `roll` about the new x [rad].
[[nodiscard]] Eigen::Matrix3d mounting_of(double roll, double pitch, double yaw);

/// Time, pose and twist of the IMU, with the vehicle's axes. `rate_B` is the angular rate without bias [rad/s].
/// Covariances, reset counter and quality are left as they are by default.
[[nodiscard]] OdometryMessage make_odometry(const NavState& x, const Eigen::Vector3d& rate_B,
                                            const Eigen::Matrix3d& R_BV);

/// Fills in the covariances. P: see estimate_error; `rate_variance` [rad^2/s^2] is the noise of rate_B, per axis.
void set_covariances(OdometryMessage& message, const NavState& x, const EstimateCovariance& P, double rate_variance,
                     const Eigen::Matrix3d& R_BV);

}  // namespace ear::mavlink
