// The sensors of a vehicle with ROS 2: topics on the wire to samples, a thread for each sensor.
#pragma once

#include <condition_variable>
#include <memory>
#include <mutex>
#include <string>
#include <vector>

#include "src/dds/participant.h"
#include "src/live/intake.h"
#include "src/log/repeat_limit.h"
#include "src/ros2/calibration_messages.h"
#include "src/ros2/image_messages.h"
#include "src/ros2/imu_messages.h"
#include "src/ros2/laser_messages.h"
#include "src/ros2/wheel_messages.h"

namespace ear::live {

/// Messages that could not be used, for another thread to say; any thread.
class Complaints {
 public:
  void add(const std::string& words);
  [[nodiscard]] std::vector<std::string> take();

 private:
  std::mutex mutex_;
  std::vector<std::string> words_;
};

/// Hands samples to the intake. A message that cannot be read is passed over, and said.
class RosSensors {
 public:
  /// Reads the topics of the sensors that `intake` has a calibration for. Both must outlive it.
  RosSensors(const dds::Participant& participant, const ros2::SensorTopics& topics, Intake& intake);

  /// By one thread, a few times a second: what changed, in words.
  [[nodiscard]] std::vector<std::string> look();

 private:
  void take_imu(const dds::Received& message);
  void take_wheels(const dds::Received& message);
  void take_beam(const dds::Received& message);
  void take_image(const dds::Received& message);
  template <typename Work>
  void guarded(const Work& work);
  [[nodiscard]] ros2::RawMessage raw(const dds::Received& message) const;

  ros2::SensorTopics topics_;
  Intake& intake_;
  ros2::ImuMessages imu_;
  ros2::WheelMessages wheels_;
  ros2::LaserMessages beams_;
  ros2::StereoPairing pairing_;
  Complaints complaints_;
  RepeatLimit limit_{10.0};
  std::vector<std::unique_ptr<dds::Subscription>> subscriptions_;  ///< last: their threads use all else
};

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

/// Which topics there are now, for ros2::guess_topics().
[[nodiscard]] std::vector<ros2::Topic> topics_of(const dds::Participant& participant);

}  // namespace ear::live
