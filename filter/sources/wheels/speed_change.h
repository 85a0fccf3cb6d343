// How fast the speed of the rims changes, by which a reading whose stamp is wrong is off. docs/filter.md, "Wheels".
#pragma once

#include <algorithm>
#include <cmath>
#include <optional>

#include "filter/ingest/limits.h"

namespace ear {

/// The speed less its mean over the last kStale, over that time: slow enough that vibration is no change. What the
/// state's own uncertainty could feign is none either: the errors of a predicted speed are in its row's residual too,
/// and would be taken for a time.
class SpeedChange {
 public:
  /// The predicted speed [m/s], its standard deviation and how long it lasted [s]; the change [m/s^2].
  double add(double speed, double sigma, double dt) {
    recent_ = recent_.value_or(speed);
    *recent_ += std::min(1.0, dt / kStale) * (speed - *recent_);
    const double change = speed - *recent_;
    return std::abs(change) > kClear * sigma ? change / kStale : 0.0;
  }

 private:
  std::optional<double> recent_;  ///< [m/s]
};

}  // namespace ear
