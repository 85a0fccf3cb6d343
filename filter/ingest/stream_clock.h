// The clock of a sensor beside the inertial one. Where its stamps jump, and its readings do not come in otherwise than
// before, the jump is taken out; put back where the sensor's own stamps turn out to be where they always were. Readings
// that come late keep their steps, those that are missing leave their time out in both: neither is a jump.
// docs/ingest.md.
#pragma once

#include <cmath>
#include <optional>

#include "ear/types.h"
#include "filter/ingest/limits.h"

namespace ear {

inline constexpr double kClockJump = 0.04;  ///< [s] chosen: either way; less may be a driver that was held up
/// Chosen: readings in a row, to put back what was taken out: so many do not all have false stamps, whatever their
/// rate.
inline constexpr int kContradictions = 8;

/// Of any sensor. `off`: by how much a stamp is off the place where it should be [s]. If it is more than what a state
/// outlasts, it is another clock.
[[nodiscard]] inline bool is_clock_jump(double off) { return std::abs(off) > kClockJump && std::abs(off) < kLostAfter; }

/// Is `off` nearer to zero than to a jump of this size?
[[nodiscard]] inline bool is_small_against(double jump, double off) { return std::abs(off) < 0.5 * std::abs(jump); }

class StreamClock {
 public:
  /// The stamp of a reading by the common clock, `now_ns` being the newest inertial sample, if that gives the time:
  /// to within `tick`, the interval of these [s]. Nothing for the first one after a jump, which may have a false stamp
  /// of its own.
  [[nodiscard]] std::optional<TimeNs> correct(TimeNs stamp_ns, std::optional<TimeNs> now_ns, double tick = 0.0);

  /// Taken out, and not put back.
  [[nodiscard]] int jumps() const { return jumps_; }

 private:
  [[nodiscard]] double jump_at(TimeNs t_ns, TimeNs now_ns, double tick) const;
  void follow(TimeNs t_ns, std::optional<TimeNs> now_ns);
  [[nodiscard]] bool shift_was_wrong(TimeNs stamp_ns, TimeNs now_ns);

  TimeNs shift_ns_ = 0;            ///< the sensor's clock less the common one
  std::optional<TimeNs> last_ns_;  ///< of the stamps that followed, corrected
  std::optional<TimeNs> last_now_ns_;
  std::optional<TimeNs> suspect_ns_;  ///< the one before, if it may have jumped
  double interval_ = 0.0;             ///< [s] usual
  double ahead_ = 0.0;                ///< [s] of the inertial samples, usually
  int count_ = 0;                     ///< of those
  int jumps_ = 0;
  int contradictions_ = 0;  ///< readings in a row against the shift
};

}  // namespace ear
