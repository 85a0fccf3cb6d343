// How the body moved from one keyframe to the next, by the inertial samples, as seen from the first: what ties readings
// at any time to a keyframe.
#pragma once

#include <Eigen/Core>
#include <array>
#include <vector>

#include "ear/calibration.h"
#include "ear/estimate.h"
#include "smoother/imu_preintegration.h"

namespace ear::calibration {

/// A stretch of constant rate and force, as measured.
struct InertialPiece {
  TimeNs from_ns = 0;
  double dt = 0.0;                                    ///< [s]
  Eigen::Vector3d gyro_B = Eigen::Vector3d::Zero();   ///< [rad/s]
  Eigen::Vector3d accel_B = Eigen::Vector3d::Zero();  ///< [m/s^2]
  double jump = 0.0;                                  ///< of the force between the samples around it [m/s^2]
};

/// From one time to another; samples are in order and reach over both. Empty where they do not.
[[nodiscard]] std::vector<InertialPiece> pieces_between(const std::vector<ImuSample>& imu, TimeNs from_ns,
                                                        TimeNs to_ns);

/// The body at one time, in the body at the keyframe.
struct PathNode {
  TimeNs t_ns = 0;
  Eigen::Matrix3d R_kt = Eigen::Matrix3d::Identity();
  Eigen::Vector3d p_kt = Eigen::Vector3d::Zero();    ///< [m]
  Eigen::Vector3d v_kt = Eigen::Vector3d::Zero();    ///< in the world's frame of rest, axes of the keyframe [m/s]
  Eigen::Vector3d rate_B = Eigen::Vector3d::Zero();  ///< [rad/s], of what follows
  Eigen::Matrix3d J_v_ba = Eigen::Matrix3d::Zero();  ///< derivatives of v_kt and p_kt by the accelerometer's bias
  Eigen::Matrix3d J_p_ba = Eigen::Matrix3d::Zero();
};

/// E of the gyroscope, column by column: rate = (I + E) measured.
using GyroErrors = std::array<double, 9>;
[[nodiscard]] Eigen::Matrix3d gyro_matrix(const GyroErrors& errors);

/// The pieces with the rates that `matrix` times what the gyroscope measured are.
[[nodiscard]] std::vector<InertialPiece> corrected(std::vector<InertialPiece> pieces, const Eigen::Matrix3d& matrix);

/// Nodes at the ends of all pieces, from a state at the keyframe.
[[nodiscard]] std::vector<PathNode> path_along(const std::vector<InertialPiece>& pieces, const NavState& from);

/// Between the nodes, and a little beyond them.
[[nodiscard]] PathNode at(const std::vector<PathNode>& path, TimeNs t_ns);

/// Pieces pre-integrated, and what the gyroscope's errors do to that.
struct Preintegrated {
  smoother::ImuPreintegration motion;
  GyroErrors at{};                     ///< the errors that it is taken with
  Eigen::Matrix<double, 9, 9> J_gyro;  ///< of (xi, dv, dp) by the errors
};

/// The pieces, as measured, with a state's biases and the gyroscope's errors. Strikes, where the force jumps, count
/// with more noise.
[[nodiscard]] Preintegrated preintegrated(const std::vector<InertialPiece>& pieces, const NavState& from,
                                          const GyroErrors& errors, const ImuCalibration& noise);

}  // namespace ear::calibration
