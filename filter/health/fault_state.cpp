#include "filter/health/fault_state.h"

#include <algorithm>

namespace ear {

void FaultState::add(bool wrong, TimeNs t_ns) {
  const TimeNs dt = last_ns_ ? std::clamp(duration_ns(*last_ns_, t_ns), TimeNs{0}, kFaultyAfter) : 0;
  last_ns_ = t_ns;
  if (wrong && !suspected_) onset_ns_ = t_ns;
  suspected_ = wrong || suspicion_ > 0;
  const TimeNs change = wrong ? dt : -dt * kFaultyAfter / kSoundAfter;
  suspicion_ = std::clamp(suspicion_ + change, TimeNs{0}, kFaultyAfter);
  if (suspicion_ == kFaultyAfter) sound_ = false;
  if (suspicion_ == 0 && !wrong) {
    sound_ = true;
    suspected_ = false;
  }
}

void FaultState::report(TimeNs t_ns) {
  if (!suspected_) onset_ns_ = t_ns;
  suspected_ = true;
  suspicion_ = kFaultyAfter;
  sound_ = false;
  last_ns_ = t_ns;
}

void FaultState::clear(TimeNs t_ns) {
  suspicion_ = 0;
  suspected_ = false;
  sound_ = true;
  last_ns_ = t_ns;
}

}  // namespace ear
