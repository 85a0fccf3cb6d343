#include "filter/health/stamp_watch.h"

#include <algorithm>
#include <cmath>

#include "filter/ingest/stream_clock.h"

namespace ear {
namespace {

constexpr double kStampOff = 0.06;     // [s] chosen: off the usual
constexpr double kStampSpreads = 6.0;  // chosen: mean deviations
constexpr double kStampMemory = 30.0;  // [s] chosen: what is usual changes slowly

}  // namespace

bool StampWatch::add(TimeNs stamp_ns, TimeNs imu_ns) {
  const double ahead = seconds_between(imu_ns, stamp_ns);
  const double off = std::abs(ahead - usual_);
  const double passed = std::clamp(seconds_between(last_imu_ns_, imu_ns) / kStampMemory, 0.0, 1.0);
  const double share = std::max(passed, 1.0 / (count_ + 1));
  last_imu_ns_ = imu_ns;
  const bool unusual = count_ >= kToKnow && off > std::max(kStampOff, kStampSpreads * spread_);
  const double counted = std::min(off, kStampOff);  // what is usual changes slowly
  usual_ += share * std::clamp(ahead - usual_, -counted, counted);
  spread_ += share * (counted - spread_);
  ++count_;
  return unusual;
}

}  // namespace ear
