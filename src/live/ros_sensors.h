// The sensors of a vehicle with ROS 2: topics on the wire to samples, a thread for each sensor.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "src/dds/participant.h"
#include "src/live/intake.h"
#include "src/live/ros_topics.h"
#include "src/log/repeat_limit.h"
#include "src/ros2/image_messages.h"
#include "src/ros2/imu_messages.h"
#include "src/ros2/laser_messages.h"
#include "src/ros2/wheel_messages.h"

namespace ear::live {

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

}  // namespace ear::live
