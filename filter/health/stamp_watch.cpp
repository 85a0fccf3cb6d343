#include "filter/health/stamp_watch.h"

#include <algorithm>
#include <cmath>

#include "filter/ingest/stream_clock.h"

namespace ear {
bool StampWatch::add(TimeNs stamp_ns, TimeNs imu_ns) {
  const double passed = std::clamp(seconds_between(last_imu_ns_, imu_ns) / kSlopeMemory, 0.0, 1.0);
  const double share = std::max(passed, 1.0 / (count_ + 1));
  last_imu_ns_ = imu_ns;
  const double off = seconds_between(imu_ns, stamp_ns) - usual_;
  const bool unusual = count_ >= kToKnow && std::abs(off) > std::max(kClockJump, kClear * std::sqrt(variance_));
  const double counted = std::clamp(off, -kClockJump, kClockJump);  // what is usual changes slowly
  usual_ += share * counted;
  variance_ += share * (counted * counted - variance_);
  ++count_;
  return unusual;
}

}  // namespace ear
