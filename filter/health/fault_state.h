// For and against one sensor, over time.
#pragma once

#include <optional>

#include "ear/types.h"

namespace ear {

/// Mostly wrong for kFaultyAfter, it is faulty; mostly right for kSoundAfter, it is sound again.
class FaultState {
 public:
  static constexpr TimeNs kFaultyAfter = 250'000'000;  // [ns] chosen; docs/health.md
  static constexpr TimeNs kSoundAfter = 500'000'000;   // [ns] chosen; a lost estimate must fit for so long, too

  /// What came since the last call: wrong or right. Long silence counts for kFaultyAfter at most.
  void add(bool wrong, TimeNs t_ns);
  /// Something that never happens to a sound sensor.
  void report(TimeNs t_ns);
  /// It has nothing to show, rightly.
  void clear(TimeNs t_ns);

  [[nodiscard]] bool sound() const { return sound_; }
  [[nodiscard]] TimeNs onset_ns() const { return onset_ns_; }

 private:
  TimeNs suspicion_ = 0;    ///< up to kFaultyAfter
  bool suspected_ = false;  ///< since onset_ns_
  bool sound_ = true;
  TimeNs onset_ns_ = 0;
  std::optional<TimeNs> last_ns_;
};

}  // namespace ear
