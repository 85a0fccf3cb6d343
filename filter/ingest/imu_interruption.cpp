#include "filter/ingest/imu_interruption.h"

#include <algorithm>
#include <cmath>

#include "filter/ingest/limits.h"

namespace ear {

/// A gap that the state has not passed yet grows by the next one.
void ImuInterruption::add_gap(TimeNs from_ns, TimeNs to_ns, const Unseen& unseen) {
  if (!gap_) gap_ = Gap{from_ns, to_ns, {}, 0.0};
  gap_->to_ns = to_ns;
  if (unseen.time > 0.0) gap_->counted *= gap_->unseen.time / (gap_->unseen.time + unseen.time);
  gap_->unseen.time += unseen.time;
  gap_->unseen.unmeasured += unseen.unmeasured;
}

void ImuInterruption::add_uncertain(TimeNs t_ns) {
  if (!uncertain_since_ns_) uncertain_since_ns_ = t_ns;
}

/// What the vehicle did in the gap, it did all the time: standard deviations grow with the time.
ImuInterruption::Unseen ImuInterruption::take_unseen(TimeNs t_ns) {
  if (!gap_ || t_ns <= gap_->from_ns) return {};
  const bool over = t_ns >= gap_->to_ns;
  const double passed = seconds_between(gap_->from_ns, t_ns) / seconds_between(gap_->from_ns, gap_->to_ns);
  const double share = over ? 1.0 : std::max(passed, gap_->counted);  // counted before the gap grew longer
  const double part = std::sqrt(share * share - gap_->counted * gap_->counted);
  const Unseen unseen = {gap_->unseen.time * part, gap_->unseen.unmeasured * part};
  gap_->counted = share;
  if (over) gap_.reset();
  add_uncertain(t_ns);
  return unseen;
}

bool ImuInterruption::take_uncertain() {
  const bool uncertain = uncertain_since_ns_.has_value();
  uncertain_since_ns_.reset();
  return uncertain;
}

bool ImuInterruption::waits_for_images(TimeNs t_ns) const {
  const auto since = [t_ns](TimeNs from_ns) { return seconds_between(from_ns, t_ns); };
  return (gap_ && since(gap_->from_ns) > 0.0) || (uncertain_since_ns_ && since(*uncertain_since_ns_) < kStreamGap) ||
         (bridged_ns_ && since(*bridged_ns_) < kSilent);
}

}  // namespace ear
