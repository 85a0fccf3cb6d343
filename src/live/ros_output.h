// Estimates as ROS 2 messages: nav_msgs/Odometry, tf, diagnostics. Frames as REP-103 and REP-105 have them.
#pragma once

#include <Eigen/Geometry>
#include <string>
#include <utility>

#include "src/live/live_estimator.h"
#include "src/live/ros_names.h"
#include "src/ros2/calibration_messages.h"

namespace ear::live {

/// Messages of estimates. The pose is that of base_frame, which sits in the body as T_B_base says.
class RosMessages {
 public:
  RosMessages(RosNames names, const Eigen::Isometry3d& T_B_base) : names_(std::move(names)), T_B_base_(T_B_base) {}

  /// `rate_B`: angular rate without bias [rad/s]. Covariances of the pose are about the axes of odom_frame, those of
  /// the twist about the axes of base_frame; without an estimate, as for predicted states, they are 0: not known.
  [[nodiscard]] ros2::Odometry odometry(const NavState& state, const Eigen::Vector3d& rate_B,
                                        const Estimate* estimate) const;
  /// base_frame to the IMU, and the IMU to cameras and beams, as `ear export` names them.
  [[nodiscard]] ros2::TfMessage frames(const Calibration& calibration, TimeNs t_ns) const;
  [[nodiscard]] ros2::TfMessage transform(const ros2::Odometry& odometry) const;
  /// Level, words, and the numbers behind them. `rates`: of the sensors, in words.
  [[nodiscard]] ros2::DiagnosticArray diagnostics(TimeNs t_ns, const Health& health, const std::string& rates) const;

  [[nodiscard]] const RosNames& names() const { return names_; }

 private:
  RosNames names_;
  Eigen::Isometry3d T_B_base_;
};

/// The poses of the last minutes, at most so many, at least 5 cm apart.
class RosPath {
 public:
  explicit RosPath(std::string frame) { path_.header.frame_id = std::move(frame); }
  /// The path, if this pose made it longer.
  [[nodiscard]] const ros2::Path* add(const ros2::Odometry& odometry);

 private:
  static constexpr std::size_t kMost = 1000;
  static constexpr double kApart = 0.05;  // [m]
  ros2::Path path_;
};

}  // namespace ear::live
