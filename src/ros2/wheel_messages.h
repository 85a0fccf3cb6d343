// sensor_msgs/JointState to readings of the wheel encoders.
#pragma once

#include <optional>
#include <utility>
#include <vector>

#include "src/ros2/raw_message.h"
#include "src/ros2/topics.h"

namespace ear::ros2 {

/// Angles become counts of `resolution` per turn, rounded to the nearest: those that `ear export` wrote come back.
class WheelMessages {
 public:
  /// `resolution`: EncoderCalibration::resolution, counts per revolution.
  WheelMessages(const SensorTopics& topics, std::int64_t resolution) : topics_(topics), resolution_(resolution) {}

  /// Throws InputError for another type or wrong bytes, joints that are not there, an angle that is not finite.
  [[nodiscard]] EncoderSample take(const RawMessage& message);

  /// The joints that the first message had, "left_wheel, right_wheel"; empty before it.
  [[nodiscard]] const std::string& joints() const { return joints_; }

 private:
  [[nodiscard]] std::pair<std::size_t, std::size_t> find(const RawMessage& message, const JointState& joints);

  SensorTopics topics_;
  std::int64_t resolution_;
  std::string joints_;
};

}  // namespace ear::ros2
