// sensor_msgs/Imu to inertial samples, united or apart.
#pragma once

#include <deque>
#include <optional>
#include <vector>

#include "src/recording/warnings.h"
#include "src/ros2/raw_message.h"
#include "src/ros2/stamp_order.h"
#include "src/ros2/topics.h"

namespace ear::ros2 {

/// One topic with both, or one each, as RealSense drivers send them. Then each sample is one of the gyroscope, and its
/// specific force is interpolated between the accelerometer's before and after it: it comes out once that one is there.
/// The result depends on the stamps alone, not on which topic was first.
class ImuMessages {
 public:
  explicit ImuMessages(const SensorTopics& topics) : topics_(topics) {}

  /// Appends the samples that are complete now. Throws InputError for another type or wrong bytes. `warnings` counts
  /// samples of the gyroscope that no two accelerations enclose within 0.1 s, and stamps that run backward, which are
  /// left out until five in a row show that the clock was set back.
  void take(const RawMessage& message, std::vector<ImuSample>& samples, Warnings& warnings);

 private:
  void pair(std::vector<ImuSample>& samples, Warnings& warnings);

  SensorTopics topics_;
  StampOrder gyro_order_, accel_order_;
  std::deque<ImuSample> gyro_;   // waiting for an acceleration that is not earlier
  std::deque<ImuSample> accel_;  // the one before the oldest of gyro_, and all after it
};

}  // namespace ear::ros2
