#include "src/mavlink/clock_sync.h"

#include <algorithm>
#include <cmath>

namespace ear::mavlink {
namespace {

constexpr double kLongest = 0.1;       // [s] a round trip that shows nothing
constexpr double kUsual = 2.0;         // times the quickest round trip: such exchanges count
constexpr double kUsualMargin = 1e-3;  // [s] and so much more
constexpr double kForget = 1.01;       // the quickest round trip grows by this with each exchange
constexpr double kStep = 0.05;         // [s] from the offset: its clock has been set, if it stays so
constexpr int kStepExchanges = 3;
constexpr double kFinalGain = 0.02;  // of the offset, once it is known
constexpr double kFinalDrift = 2e-4;
constexpr double kMostDrift = 5e-4;  // of any crystal

bool is_stamp(TimeNs t_ns) { return t_ns > -kLargestStamp && t_ns < kLargestStamp; }
TimeNs to_ns(double seconds) { return static_cast<TimeNs>(std::llround(1e9 * seconds)); }

}  // namespace

void ClockSync::restart() {
  used_ = 0;
  far_off_ = 0;
  drift_ = 0.0;
}

void ClockSync::add(TimeNs sent_ns, TimeNs remote_ns, TimeNs now_ns) {
  const double trip = seconds_between(sent_ns, now_ns);
  if (trip < 0.0 || trip > kLongest || !is_stamp(remote_ns)) return;
  round_trip_ = used_ == 0 ? trip : std::min(trip, round_trip_ * kForget);
  if (trip > kUsual * round_trip_ + kUsualMargin) return;

  const TimeNs middle_ns = sent_ns + (now_ns - sent_ns) / 2;
  const TimeNs measured_ns = duration_ns(middle_ns, remote_ns);
  if (used_ == 0) {
    offset_ns_ = measured_ns;
    at_ns_ = middle_ns;
    used_ = 1;
    return;
  }
  const double dt = seconds_between(at_ns_, middle_ns);
  const double innovation = seconds_between(offset_ns_ + to_ns(drift_ * dt), measured_ns);
  if (std::abs(innovation) > kStep) {
    if (++far_off_ < kStepExchanges) return;
    restart();
    ++steps_;
    add(sent_ns, remote_ns, now_ns);
    return;
  }
  far_off_ = 0;
  offset_ns_ += to_ns(drift_ * dt);
  at_ns_ = middle_ns;
  correct(innovation, dt);
}

/// Gains that fall as those of a mean do, down to those of slow tracking.
void ClockSync::correct(double innovation, double dt) {
  ++used_;
  const double gain = std::max(kFinalGain, 1.0 / used_);
  offset_ns_ += to_ns(gain * innovation);
  if (!ready() || dt <= 0.0) return;
  drift_ = std::clamp(drift_ + kFinalDrift * innovation / dt, -kMostDrift, kMostDrift);
}

std::optional<TimeNs> ClockSync::to_ours(TimeNs remote_ns) const {
  if (!ready()) return std::nullopt;
  const TimeNs ours = duration_ns(offset_ns_, remote_ns);
  return ours - to_ns(drift_ * seconds_between(at_ns_, ours));
}

}  // namespace ear::mavlink
