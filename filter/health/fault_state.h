// For and against one sensor, over time.
#pragma once

#include <optional>

#include "ear/types.h"

namespace ear {

/// Mostly wrong for kFaultyAfter seconds, it is faulty; mostly right for kSoundAfter, it is sound again.
class FaultState {
 public:
  static constexpr double kFaultyAfter = 0.25;  // [s] chosen: docs/health.md promises half a second
  static constexpr double kSoundAfter = 0.5;    // [s] chosen; a lost estimate must fit for so long, too

  /// What came since the last call: wrong or right. Long silence counts for kFaultyAfter at most.
  void add(bool wrong, TimeNs t_ns);
  /// Something that never happens to a sound sensor.
  void report(TimeNs t_ns);
  /// It has nothing to show, rightly.
  void clear(TimeNs t_ns);

  [[nodiscard]] bool sound() const { return sound_; }
  [[nodiscard]] TimeNs onset_ns() const { return onset_ns_; }

 private:
  double suspicion_ = 0.0;  ///< 0 ... 1
  bool suspected_ = false;  ///< since onset_ns_
  bool sound_ = true;
  TimeNs onset_ns_ = 0;
  std::optional<TimeNs> last_ns_;
};

}  // namespace ear
