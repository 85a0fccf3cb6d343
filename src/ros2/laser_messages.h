// sensor_msgs/Range, or LaserScan of one beam, to readings of the lasers.
#pragma once

#include <deque>
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

/// Collects the ranges of one instant: those whose stamps are within 10 ms of the first of them. Each beam has a topic
/// of its own, so that messages of one instant may come after those of the next.
class LaserMessages {
 public:
  LaserMessages(const SensorTopics& topics, const LaserCalibration& lasers);

  /// Appends readings, in time order, to which nothing more will come: each beam is there, has already sent a later
  /// message, or is silent for 0.5 s. Beams without a message are NaN, as are ranges outside of the calibration's.
  /// Throws InputError for another type or wrong bytes.
  void take(const RawMessage& message, std::vector<LaserSample>& samples);
  /// Appends what is not complete, at the end of a recording.
  void finish(std::vector<LaserSample>& samples);

 private:
  /// A reading that waits for its beams.
  struct Pending {
    LaserSample sample;
    std::vector<bool> there;
  };

  [[nodiscard]] Pending& pending_at(TimeNs t_ns, std::size_t beam);
  [[nodiscard]] bool is_done(const Pending& pending) const;

  SensorTopics topics_;
  LaserCalibration lasers_;
  std::deque<Pending> pending_;  ///< in time order
  std::vector<TimeNs> last_ns_;  ///< of each beam: stamp of its last message; before that, of the first one of any
  TimeNs latest_ns_ = 0;         ///< of the last message
};

}  // namespace ear::ros2
