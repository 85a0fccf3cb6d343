// sensor_msgs/Range, or LaserScan of one beam, to readings of the lasers.
#pragma once

#include <optional>
#include <vector>

#include "ear/calibration.h"
#include "src/ros2/raw_message.h"
#include "src/ros2/topics.h"

namespace ear::ros2 {

/// A range as its message has it, in double precision: the shortest decimal number that this float stands for, so that
/// 0.1235 m stay 0.1235 m.
[[nodiscard]] double range_of(float range);

/// The beam's range, and where it holds: of a Range, or of a LaserScan with one ray. Throws InputError for others.
[[nodiscard]] Range range_message(const RawMessage& message);

/// Collects the ranges of one instant: those whose stamps are within 10 ms of the first of them.
class LaserMessages {
 public:
  LaserMessages(const SensorTopics& topics, const LaserCalibration& lasers);

  /// Appends readings that are complete: all beams are there, or a later one comes. Beams without a message are NaN, as
  /// are ranges outside of the calibration's. Throws InputError for another type or wrong bytes.
  void take(const RawMessage& message, std::vector<LaserSample>& samples);
  /// What is not complete, at the end of a recording.
  [[nodiscard]] std::optional<LaserSample> rest();

 private:
  SensorTopics topics_;
  LaserCalibration lasers_;
  LaserSample current_;       // empty range: none
  std::vector<bool> filled_;  // beams of current_ that came
};

}  // namespace ear::ros2
