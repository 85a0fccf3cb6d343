#include "filter/health/stamp_watch.h"

#include <algorithm>
#include <cmath>

#include "filter/ingest/stream_clock.h"

namespace ear {
namespace {

constexpr double kStampOff = 0.06;       // [s] chosen: off the usual
constexpr double kStampSpreads = 6.0;    // chosen: mean deviations
constexpr double kStampMemory = 1000.0;  // stamps, chosen: what is usual changes slowly

}  // namespace

bool StampWatch::add(TimeNs stamp_ns, TimeNs imu_ns) {
  const double ahead = seconds_between(imu_ns, stamp_ns);
  const double off = std::abs(ahead - usual_);
  const double share = std::max(1.0 / kStampMemory, 1.0 / (count_ + 1));
  const bool unusual = count_ >= kToKnow && off > std::max(kStampOff, kStampSpreads * spread_);
  const double counted = std::min(off, kStampOff);  // what is usual changes slowly
  usual_ += share * std::clamp(ahead - usual_, -counted, counted);
  spread_ += share * (counted - spread_);
  ++count_;
  return unusual;
}

}  // namespace ear
