// How noisy the readings of wheels are, as they show it themselves: coarse counts, and stamps that are not those of the
// moment of reading. docs/filter.md, "Wheels".
#pragma once

#include <algorithm>
#include <cmath>

#include "filter/ingest/limits.h"
#include "filter/ingest/wheel_increment.h"

namespace ear {

/// A reading's error e_k is taken back by the next one: the speed between two is off by (e_k - e_k-1) / dt, and two
/// steps of the speed in a row share -4 var(e) / dt^2. Of the vehicle's motion they share little, and nothing less than
/// zero: it goes on as it was.
class ReadingNoise {
 public:
  /// The mean speed in an increment, of a path or of an angle.
  void add(double speed, const WheelIncrement& increment) {
    const double dt = increment.duration();
    if (increment.from_ns != last_ns_ || std::max(dt, dt_) > longest_silence(std::min(dt, dt_))) steps_ = -1;
    last_ns_ = increment.to_ns;
    const double step = 0.5 * (dt + dt_) * (speed - speed_);
    if (steps_ > 0) shared_ += std::min(1.0, dt / kStreamMemory) * (step * step_ - shared_);
    steps_ = std::min(steps_ + 1, 1);
    step_ = step;
    speed_ = speed;
    dt_ = dt;
  }

  /// Standard deviation of what an increment is off by, which has the errors of two readings: of the path or angle.
  [[nodiscard]] double of_increment() const { return std::sqrt(0.5 * std::max(0.0, -shared_)); }

 private:
  TimeNs last_ns_ = 0;
  int steps_ = -1;       ///< since readings follow one another, up to one: -1 before the first speed
  double speed_ = 0.0;   ///< of the increment before
  double dt_ = 0.0;      ///< [s] its duration
  double step_ = 0.0;    ///< of the speed, times the interval
  double shared_ = 0.0;  ///< mean product of two steps in a row
};

}  // namespace ear
