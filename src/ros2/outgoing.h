// Our samples to messages.
#pragma once

#include <Eigen/Geometry>
#include <cstddef>
#include <cstdint>
#include <string>

#include "ear/calibration.h"
#include "ear/types.h"
#include "src/ros2/messages.h"

namespace ear::ros2 {

/// All throw InputError for a stamp that a message cannot hold. Frames as in static_frames().
[[nodiscard]] Imu imu_message(const ImuSample& sample);
/// Angles of the joints "left" and "right" [rad], of `resolution` counts per turn.
[[nodiscard]] JointState joint_message(const EncoderSample& sample, std::int64_t resolution);
/// Of one beam; no return is infinite (REP-117).
[[nodiscard]] Range range_message(const LaserSample& sample, std::size_t beam, const LaserCalibration& lasers);
/// mono8.
[[nodiscard]] Image image_message(const ImageView& image, std::size_t camera, TimeNs t_ns);
[[nodiscard]] Pose pose_message(const Eigen::Quaterniond& q, const Eigen::Vector3d& p);

}  // namespace ear::ros2
