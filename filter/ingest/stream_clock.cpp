#include "filter/ingest/stream_clock.h"

#include <algorithm>
#include <cmath>

namespace ear {

/// By how much a stamp is ahead of where readings that come at that time should be; 0 if that is no jump [s]. After a
/// pause steps show nothing.
double StreamClock::jump_at(TimeNs t_ns, TimeNs now_ns, double tick) const {
  const double passed = seconds_between(*last_now_ns_, now_ns);
  if (passed > longest_silence(interval_)) return 0.0;
  const auto intervals = [this](double duration) { return std::max(1.0, std::round(duration / interval_)); };
  const double step = seconds_between(*last_ns_, t_ns);
  const double least = step - interval_ * std::clamp(intervals(step), intervals(passed - tick), intervals(passed));
  if (!is_clock_jump(least)) return 0.0;
  const double jump = step - interval_ * intervals(passed);
  const double ahead = seconds_between(now_ns, t_ns) - ahead_;
  return is_clock_jump(jump) && std::abs(jump) > tick && is_small_against(jump, ahead - jump) ? jump : 0.0;
}

void StreamClock::follow(TimeNs t_ns, std::optional<TimeNs> now_ns) {
  if (now_ns && last_ns_ && last_now_ns_) {
    const double step = seconds_between(*last_ns_, t_ns);
    const double share = std::max(std::min(interval_ / kStreamMemory, 1.0), 1.0 / (count_ + 1));
    if (step > 0.0 && (count_ < kToKnow || std::abs(step - interval_) < kClockJump))
      interval_ += share * (step - interval_);
    ahead_ += share * (seconds_between(*now_ns, t_ns) - ahead_);
    ++count_;
  }
  last_ns_ = t_ns;
  last_now_ns_ = now_ns;
  suspect_ns_.reset();
}

/// A process that stood still gets the readings of one sensor before those of the other, which looks like a jump until
/// both have caught up.
bool StreamClock::shift_was_wrong(TimeNs stamp_ns, TimeNs now_ns) {
  const double own = seconds_between(now_ns, stamp_ns) - ahead_;
  const double shifted = own - 1e-9 * static_cast<double>(shift_ns_);
  const bool against = shift_ns_ != 0 && is_clock_jump(shifted) && is_small_against(shifted, own);
  contradictions_ = against ? contradictions_ + 1 : 0;
  return contradictions_ >= kContradictions;
}

std::optional<TimeNs> StreamClock::correct(TimeNs stamp_ns, std::optional<TimeNs> now_ns, double tick) {
  if (!is_time(stamp_ns)) return stamp_ns;  // for the input guard to refuse
  if (now_ns && shift_was_wrong(stamp_ns, *now_ns)) {
    shift_ns_ = 0;
    contradictions_ = 0;
    --jumps_;
    last_ns_.reset();
  }
  TimeNs t_ns = stamp_ns - shift_ns_;
  if (count_ >= kToKnow && now_ns && last_ns_ && last_now_ns_) {
    const double jump = jump_at(t_ns, *now_ns, tick);
    if (jump != 0.0) {
      const bool follows = suspect_ns_ && std::abs(seconds_between(*suspect_ns_, t_ns) - interval_) < kClockJump;
      suspect_ns_ = t_ns;
      if (!follows) return std::nullopt;
      shift_ns_ = later_by(jump, shift_ns_);
      t_ns = later_by(-jump, t_ns);
      ++jumps_;
    }
  }
  follow(t_ns, now_ns);
  return t_ns;
}

}  // namespace ear
