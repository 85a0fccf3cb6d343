// How fast the speed of the rims changes, by which a reading whose stamp is wrong is off. docs/filter.md, "Wheels".
#pragma once

#include <algorithm>
#include <cmath>

#include "filter/ingest/limits.h"
#include "filter/ingest/wheel_increment.h"

namespace ear {

/// The speed less its mean over the last kStale, over that time: slow enough that vibration is no change. What the
/// state's own uncertainty could feign is none either: the errors of a predicted speed are in its row's residual too,
/// and would be taken for a time.
class SpeedChange {
 public:
  /// The speed predicted of an increment, as stamped, and its standard deviation [m/s]; the change [m/s^2].
  double add(double speed, double sigma, const WheelIncrement& increment) {
    if (increment.from_ns != last_ns_) recent_ = speed;
    last_ns_ = increment.to_ns;
    recent_ += std::min(1.0, increment.duration() / kStale) * (speed - recent_);
    const double change = speed - recent_;
    return std::abs(change) > kClear * sigma ? change / kStale : 0.0;
  }

 private:
  TimeNs last_ns_ = 0;
  double recent_ = 0.0;  ///< since readings follow one another [m/s]
};

}  // namespace ear
