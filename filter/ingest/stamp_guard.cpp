#include "filter/ingest/stamp_guard.h"

#include "filter/ingest/limits.h"

namespace ear {

Stamp StampGuard::judge(TimeNs t_ns) {
  const bool ahead = !last_ns_ || t_ns > *last_ns_;
  if (!last_ns_ || (ahead && seconds_between(*last_ns_, t_ns) <= kStreamGap)) {
    last_ns_ = t_ns;
    run_ = 0;
    return Stamp::next;
  }
  const bool follows = run_ > 0 && t_ns > run_to_ns_ && seconds_between(run_to_ns_, t_ns) <= kStreamGap;
  run_ = follows ? run_ + 1 : 1;
  if (!follows) run_from_ns_ = t_ns;
  run_to_ns_ = t_ns;

  const bool confirmed = ahead ? run_ >= kConfirmed : seconds_between(run_from_ns_, t_ns) >= kLasting;
  if (!confirmed) return ahead ? Stamp::far_ahead : Stamp::not_later;
  clock_shift_ = ahead ? 0 : run_from_ns_ - *last_ns_;
  last_ns_ = t_ns;
  run_ = 0;
  return ahead ? Stamp::next : Stamp::set_back;
}

}  // namespace ear
