// The calibration of a vehicle with ROS 2, from its own topics.
#pragma once

#include <condition_variable>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <vector>

#include "ear/calibration.h"
#include "src/dds/participant.h"
#include "src/live/ros_topics.h"
#include "src/ros2/calibration_messages.h"

namespace ear::live {

/// Cameras and beams as CameraInfo, tf_static and the messages themselves describe them.
class RosCalibration {
 public:
  /// Begins to collect.
  RosCalibration(const dds::Participant& participant, const ros2::SensorTopics& topics);

  /// Waits so long [s], or until there is all that the topics need; what is missing, in words, or "".
  [[nodiscard]] std::string wait(double seconds);
  /// What changed, as RosSensors::look().
  [[nodiscard]] std::vector<std::string> look();

  /// `known`, with cameras and beams from messages where it has none. Throws InputError where that cannot be.
  [[nodiscard]] Calibration complete(Calibration known) const;
  /// The pose of base_link in the IMU's frame, where tf_static has it.
  [[nodiscard]] std::optional<Eigen::Isometry3d> T_B_base() const;  // NOLINT(readability-identifier-naming)

 private:
  [[nodiscard]] std::string missing() const;
  void take(const dds::Received& message);

  ros2::SensorTopics topics_;
  mutable std::mutex mutex_;
  std::condition_variable changed_;
  ros2::CalibrationMessages messages_;
  std::vector<TimeNs> image_stamps_;  ///< of the left camera, the first few
  Complaints complaints_;
  std::unique_ptr<dds::Subscription> subscription_;
};

}  // namespace ear::live
