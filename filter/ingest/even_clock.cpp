#include "filter/ingest/even_clock.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "filter/ingest/limits.h"
#include "filter/ingest/stream_clock.h"

namespace ear {
namespace {

constexpr double kHeldUp = 10.0;  // [s] chosen: no driver is held up so long; measured: 6 s

}  // namespace

/// The slope of the regression is 1 where stamps say when readings were taken, 0 where their scatter says nothing.
/// Intervals whose length does not last are not even either: within kHeldUp some reading comes on time.
bool EvenClock::is_even() const {
  const Regression& r = regression_;
  if (!on_time_ || r.xx <= 0.0) return false;
  const double slope = r.xy / r.xx;
  const double variance = (r.yy - slope * r.xy) / std::max(1.0, r.count - 1.0) / r.xx;
  return slope + kClear * std::sqrt(std::max(0.0, variance)) < 0.5;
}

/// More than one where readings were lost: then the wheels turned by as much more.
double EvenClock::intervals_in(const WheelIncrement& increment) const {
  if (count_ == 0.0) return 1.0;
  const double many = std::max(1.0, std::round(increment.duration() / interval_));
  if (count_ < kToKnow || intervals_ == 0.0) return many;
  const Eigen::Vector2d one = angle_ / intervals_;
  return (increment.angle - many * one).norm() < (increment.angle - one).norm() ? many : 1.0;
}

void EvenClock::compare(const WheelIncrement& increment, double intervals) {
  const double dt = increment.duration();
  if (count_ >= kToKnow && !angle_.isZero(0.0)) {
    const Eigen::Vector2d one = angle_ / intervals_;
    const Eigen::Vector2d x = (dt / interval_ - intervals) * one;
    const Eigen::Vector2d y = increment.angle - intervals * one;
    const double kept = std::exp(-dt / kSlopeMemory);
    Regression& r = regression_;
    r = {kept * r.xx + x.squaredNorm(), kept * r.xy + x.dot(y), kept * r.yy + y.squaredNorm(), kept * r.count + 1.0};
  }
  const double kept = std::exp(-dt / kStreamGap);
  angle_ = kept * angle_ + increment.angle;
  intervals_ = kept * intervals_ + intervals;
}

/// No reading is taken after it arrived, and within a while one is not held up.
void EvenClock::follow(const WheelIncrement& increment, double intervals) {
  const TimeNs stamp_ns = increment.to_ns, before_ns = even_ns_;
  even_ns_ = std::min(stamp_ns, later_by(intervals * interval_, even_ns_));
  least_late_ = std::min(least_late_, seconds_between(even_ns_, stamp_ns));
  if (seconds_between(window_ns_, stamp_ns) > kHeldUp) {
    on_time_ = least_late_ < interval_;
    even_ns_ = later_by(least_late_, even_ns_);
    window_ns_ = stamp_ns;
    least_late_ = std::numeric_limits<double>::infinity();
  }
  const double dt = increment.duration();
  const double step = is_even() ? seconds_between(before_ns, even_ns_) : dt;
  interval_ += std::max(dt / kSlopeMemory, 1.0 / (count_ += 1.0)) * (step / intervals - interval_);
}

void EvenClock::correct(WheelIncrement& increment) {
  if (count_ == 0.0 || increment.from_ns != stamp_ns_) {  // the first ones, or after a gap
    angle_.setZero();
    intervals_ = 0.0;
    even_ns_ = given_ns_ = window_ns_ = increment.from_ns;
    least_late_ = std::numeric_limits<double>::infinity();
  }
  stamp_ns_ = increment.to_ns;
  const double intervals = intervals_in(increment);
  compare(increment, intervals);
  follow(increment, intervals);

  increment.from_ns = given_ns_;
  if (is_even() && seconds_between(given_ns_, even_ns_) > 0.5 * interval_) increment.to_ns = even_ns_;
  given_ns_ = increment.to_ns;
}

}  // namespace ear
