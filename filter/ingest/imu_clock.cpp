#include "filter/ingest/imu_clock.h"

#include <algorithm>
#include <cmath>

#include "filter/ingest/limits.h"
#include "filter/ingest/stream_clock.h"

namespace ear {
namespace {

constexpr int kVotes = 2;  // chosen: readings of one sensor, for a verdict: one may have a false stamp

}  // namespace

ImuClock::ImuClock() : samples_(kCapacity) {}

bool ImuClock::jumps(double step) const { return interval_ > 0.0 && is_clock_jump(step - interval_); }

/// Can the other sensors show whose jump it is? Not if they measured meanwhile what the samples leave out.
bool ImuClock::others_show(double step) const {
  bool any = false;
  for (const Other& other : others_) {
    if (!other.before_ns) continue;
    any = true;
    if (step > 0.0 && seconds_between(*other.before_ns, *other.newest_ns) > 0.5 * step) return false;
  }
  return any;
}

/// Time passed if several readings of one sensor came meanwhile, or one in the middle. If all clocks jumped, one
/// reading may come before the first inertial sample, but with a stamp of then.
bool ImuClock::others_went_on(double step) const {
  return std::any_of(others_.begin(), others_.end(), [&](const Other& other) {
    if (other.readings == 0) return false;
    const double came = seconds_between(*last_ns_ - shift_ns_, *other.newest_ns) - other.ahead;
    return other.readings >= kVotes || is_small_against(0.5 * step, came - 0.5 * step);
  });
}

void ImuClock::follow(TimeNs driver_ns) {
  if (last_ns_) {
    const double step = seconds_between(*last_ns_, driver_ns);
    if (interval_ == 0.0 && step > 0.0) interval_ = std::min(step, kClockJump);
    if (std::abs(step - interval_) <= kClockJump) interval_ += interval_ / kStreamMemory * (step - interval_);
  }
  last_ns_ = driver_ns;
  for (Other& other : others_) {
    other.before_ns = other.newest_ns;
    other.readings = 0;
  }
  if (uncertain_ && seconds_between(uncertain_->t_ns, driver_ns) > kLostAfter) uncertain_.reset();
}

void ImuClock::add(const ImuSample& sample) {
  if (samples_.full()) return;  // nobody asked for them
  if (!is_time(sample.t_ns)) {  // for the input guard to refuse
    samples_.push(sample);
    return;
  }
  if (waiting_) {
    const double step = seconds_between(newest_waiting(), sample.t_ns);
    const bool follows = step > 0.0 && !jumps(step);
    const bool long_enough =
        samples_.size() >= kCapacity / 2 || static_cast<double>(samples_.size()) * interval_ > kStreamGap;
    if (!follows || long_enough) settle(false);
  } else if (last_ns_) {
    const double step = seconds_between(*last_ns_, sample.t_ns);
    if (others_went_on(step)) went_on_ns_ = sample.t_ns;
    if (jumps(step) && others_show(step)) {
      waiting_ = true;
      jump_ = step - interval_;
      votes_ = 0;
    }
  }
  samples_.push(sample);
  if (!waiting_) follow(sample.t_ns);
}

void ImuClock::observe(Stream stream, TimeNs stamp_ns) {
  if (!is_time(stamp_ns)) return;
  Other& other = others_[static_cast<std::size_t>(stream)];
  if (waiting_ && other.before_ns) {
    const double passed = static_cast<double>(samples_.size()) * interval_;
    const double measured = seconds_between(*other.before_ns, stamp_ns);
    votes_ += is_small_against(jump_, measured - passed) ? 1 : -1;
    const bool enough = samples_.size() >= kConfirmed || votes_ < 0;
    if (std::abs(votes_) >= kVotes && enough) settle(votes_ > 0);
  }
  if (!waiting_ && last_ns_) review(other, stamp_ns);
  other.newest_ns = stamp_ns;
  ++other.readings;
}

/// While samples wait, the first of them has a stamp that is a time; later ones may have none.
TimeNs ImuClock::newest_waiting() const {
  std::size_t n = samples_.size();
  while (n > 1 && !is_time(samples_[n - 1].t_ns)) --n;
  return samples_[n - 1].t_ns;
}

void ImuClock::settle(bool own_clock) {
  waiting_ = false;
  const TimeNs newest_ns = newest_waiting();
  if (own_clock) {
    shift_ns_ = later_by(jump_, shift_ns_);
    uncertain_ = Correction{newest_ns, jump_};
    ++corrected_;
    new_correction_ = true;
  }
  follow(newest_ns);
}

/// Do the others' stamps keep their usual distance? Where, after a verdict, they turn out to have jumped as well, it is
/// undone.
void ImuClock::review(Other& other, TimeNs stamp_ns) {
  const double ahead = seconds_between(*last_ns_ - shift_ns_, stamp_ns);
  if (!uncertain_) {
    const double passed = other.newest_ns ? seconds_between(*other.newest_ns, stamp_ns) : kStreamMemory;
    other.ahead += std::clamp(passed / kStreamMemory, 0.0, 1.0) * (ahead - other.ahead);
    return;
  }
  const double jumped = (ahead - other.ahead) / uncertain_->jump;
  uncertain_->contradictions = is_small_against(1.0, jumped - 1.0) ? uncertain_->contradictions + 1 : 0;
  if (uncertain_->contradictions < kContradictions) return;
  shift_ns_ = later_by(-uncertain_->jump, shift_ns_);
  uncertain_.reset();
  --corrected_;
}

std::optional<ImuSample> ImuClock::next() {
  if (waiting_ || samples_.empty()) return std::nullopt;
  ImuSample sample = samples_.front();
  samples_.pop();
  if (is_time(sample.t_ns)) sample.t_ns -= shift_ns_;
  return sample;
}

}  // namespace ear
