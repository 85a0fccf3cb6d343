#include "filter/health/fault_state.h"

#include <algorithm>

namespace ear {
namespace {

constexpr double kRounding = 1e-9;  // chosen: of sums that should be 1

}  // namespace

void FaultState::add(bool wrong, TimeNs t_ns) {
  const double dt = last_ns_ ? std::clamp(seconds_between(*last_ns_, t_ns), 0.0, kFaultyAfter) : 0.0;
  last_ns_ = t_ns;
  if (wrong && !suspected_) onset_ns_ = t_ns;
  suspected_ = wrong || suspicion_ > 0.0;
  suspicion_ = std::clamp(suspicion_ + (wrong ? dt / kFaultyAfter : -dt / kSoundAfter), 0.0, 1.0);
  if (suspicion_ > 1.0 - kRounding) sound_ = false;
  if (suspicion_ <= 0.0 && !wrong) {
    sound_ = true;
    suspected_ = false;
  }
}

void FaultState::report(TimeNs t_ns) {
  if (!suspected_) onset_ns_ = t_ns;
  suspected_ = true;
  suspicion_ = 1.0;
  sound_ = false;
  last_ns_ = t_ns;
}

void FaultState::clear(TimeNs t_ns) {
  suspicion_ = 0.0;
  suspected_ = false;
  sound_ = true;
  last_ns_ = t_ns;
}

}  // namespace ear
