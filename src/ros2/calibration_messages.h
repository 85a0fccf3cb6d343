// Calibration from what drivers publish: CameraInfo and tf_static, and the ranges' own limits.
#pragma once

#include <Eigen/Geometry>
#include <array>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "ear/calibration.h"
#include "src/ros2/raw_message.h"
#include "src/ros2/topics.h"

namespace ear::ros2 {

/// Which frame is where: a tree, each frame in its parent.
class FrameTree {
 public:
  void add(const TransformStamped& transform);
  [[nodiscard]] bool empty() const { return parents_.empty(); }
  /// T_ab, which takes coordinates from b to a; nothing if they do not hang together.
  [[nodiscard]] std::optional<Eigen::Isometry3d> transform(const std::string& a, const std::string& b) const;

 private:
  struct Link {
    std::string parent;
    Eigen::Isometry3d T_parent_child;
  };
  /// The root above a frame, and T_root_frame.
  [[nodiscard]] std::pair<std::string, Eigen::Isometry3d> root_of(std::string frame) const;

  std::map<std::string, Link> parents_;  // by child
};

/// Collects them until all that the topics need is there. Body is the frame of the IMU's messages. Images of topics
/// with "rect" in their names have the rectified projection (P, no distortion, turned by R), others K and D of the
/// lens. The right camera is where tf has its frame; if that is the left one's frame (rectified stereo), P says how far
/// right.
class CalibrationMessages {
 public:
  explicit CalibrationMessages(const SensorTopics& topics) : topics_(topics) {}

  /// Takes CameraInfo, tf_static, and of Imu and range messages their frame; passes over all other topics. Throws
  /// InputError for another type or wrong bytes.
  void take(const RawMessage& message);

  /// What is still missing for all cameras or all beams that have topics, in words; empty: nothing.
  [[nodiscard]] std::string missing_for_cameras() const;
  [[nodiscard]] std::string missing_for_beams() const;

  /// Throws InputError, in words, where it is not complete or cannot be used (a lens of another model, binning).
  [[nodiscard]] std::vector<CameraCalibration> cameras() const;
  [[nodiscard]] LaserCalibration lasers() const;
  /// The pose of base_frame in the IMU's frame, for odometry of base_link; nothing if tf does not have it.
  [[nodiscard]] std::optional<Eigen::Isometry3d> T_B_base() const;  // NOLINT(readability-identifier-naming)
  [[nodiscard]] const std::string& imu_frame() const { return imu_frame_; }
  [[nodiscard]] const FrameTree& frames() const { return frames_; }

 private:
  [[nodiscard]] CameraCalibration camera(std::size_t index) const;
  [[nodiscard]] Eigen::Isometry3d required(const std::string& frame, const std::string& topic) const;

  SensorTopics topics_;
  FrameTree frames_;
  std::string imu_frame_;
  std::array<std::optional<CameraInfo>, 2> infos_;
  std::array<std::optional<Range>, 3> beams_;
};

/// The other way, for what we write: CameraInfo of a camera, its K and D; and tf_static of all sensors. Frames:
/// `base_frame` (the middle of the axle, REP-105; left out without wheels), imu0, cam0, cam1 (optical, REP-103),
/// laser0_0 to laser0_2 (x along the beam).
[[nodiscard]] CameraInfo camera_info(const CameraCalibration& camera, std::size_t index, TimeNs t_ns);
[[nodiscard]] TfMessage static_frames(const Calibration& calibration, const std::string& base_frame, TimeNs t_ns);

}  // namespace ear::ros2
