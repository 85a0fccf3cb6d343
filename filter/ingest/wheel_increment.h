// From the counts of the wheel encoders to the angles that the wheels turned between two readings.
#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <cstdint>
#include <optional>

#include "ear/calibration.h"
#include "ear/types.h"
#include "filter/ingest/limits.h"
#include "filter/ingest/ring.h"

namespace ear {

/// The angles that the wheels turned relative to the body between two readings: one wheel increment.
struct WheelIncrement {
  TimeNs from_ns = 0;
  TimeNs to_ns = 0;
  Eigen::Vector2d angle = Eigen::Vector2d::Zero();  ///< left, right, growing as the wheels roll forward [rad]

  [[nodiscard]] double duration() const { return seconds_between(from_ns, to_ns); }
};

[[nodiscard]] inline TimeNs middle_of(const WheelIncrement& increment) {
  return increment.from_ns + (increment.to_ns - increment.from_ns) / 2;
}

/// The same by another clock: `offset` [s] is added.
[[nodiscard]] inline WheelIncrement later_by(double offset, const WheelIncrement& increment) {
  return {later_by(offset, increment.from_ns), later_by(offset, increment.to_ns), increment.angle};
}

/// Increments in time order: one that the state has passed, if there is one, and those to come.
class WheelIncrements {
 public:
  WheelIncrements(const std::optional<WheelIncrement>& passed, const Ring<WheelIncrement>& coming)
      : passed_(passed), coming_(coming) {}
  [[nodiscard]] std::size_t size() const { return coming_.size() + (passed_ ? 1 : 0); }
  [[nodiscard]] const WheelIncrement& operator[](std::size_t i) const {
    if (!passed_) return coming_[i];
    return i == 0 ? *passed_ : coming_[i - 1];
  }

 private:
  const std::optional<WheelIncrement>& passed_;
  const Ring<WheelIncrement>& coming_;
};

/// A part of an increment, in proportion to the time.
using IncrementPart = WheelIncrement;

/// Calls f(part) for the parts of the increments in [from_ns, to_ns], in time order, until one returns false. Readings
/// do not come when frames do: an increment is shared out in proportion, the last one goes on as it was. False if f
/// was, and where readings are missing.
template <typename Function>
bool for_each_part(const WheelIncrements& increments, TimeNs from_ns, TimeNs to_ns, const Function& f) {
  TimeNs now_ns = from_ns;
  for (std::size_t i = 0; i < increments.size() && now_ns < to_ns; ++i) {
    const WheelIncrement& whole = increments[i];
    const bool last = i + 1 == increments.size();
    if (whole.to_ns <= now_ns && !last) continue;
    const double missing =
        std::max(seconds_between(now_ns, whole.from_ns), last ? seconds_between(whole.to_ns, to_ns) : 0.0);
    if (missing > longest_silence(whole.duration())) return false;
    const TimeNs end_ns = last ? to_ns : std::min(to_ns, whole.to_ns);
    const double share = seconds_between(now_ns, end_ns) / whole.duration();
    if (!f(IncrementPart{now_ns, end_ns, whole.angle * share})) return false;
    now_ns = end_ns;
  }
  return now_ns >= to_ns;
}

/// From counts to angles: takes differences, and the wrap out.
class EncoderReader {
 public:
  explicit EncoderReader(const EncoderCalibration& calibration) : calibration_(calibration) {}

  /// The increment since the reading before; nothing for the first. A difference is taken as the shorter turn: wheels
  /// must not turn by more than half a revolution between readings.
  [[nodiscard]] std::optional<WheelIncrement> add(const EncoderSample& sample);

  /// How far the faster wheel turned since the reading before, which must be there [rad].
  [[nodiscard]] double largest_angle(const EncoderSample& sample) const;

  /// Readings farther apart [s] show nothing: of counts that wrap, not even how far the wheels turned.
  [[nodiscard]] double longest_interval() const { return calibration_.wraps ? kStreamGap : kStale; }

  /// The newest reading.
  [[nodiscard]] const std::optional<EncoderSample>& last() const { return last_; }
  void clear() { last_.reset(); }

 private:
  [[nodiscard]] double angle(std::int64_t from, std::int64_t to) const;

  EncoderCalibration calibration_;
  std::optional<EncoderSample> last_;
};

}  // namespace ear
