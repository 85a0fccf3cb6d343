// How exact the sensors are, by what a drive shows.
#pragma once

#include <vector>

#include "calibration/roll.h"
#include "calibration/segment.h"

namespace ear::calibration {

/// Standard deviation of values about zero by their median size, which a few wild ones do not change. 0 for none.
[[nodiscard]] double robust_sigma(std::vector<double> values);

/// Of one interval: what both wheels' paths differ by beyond the body's turn.
struct WheelDifference {
  double error = 0.0;  ///< [m]
  double known = 0.0;  ///< its variance by encoders and gyroscope [m^2]
  double way = 0.0;    ///< of both wheels together [m]
};

/// The slip [m/sqrt(m)] of one wheel that is likeliest beside what is known: errors of variance known + slip^2 way.
/// They count up to two standard deviations. 0 where encoders and gyroscope explain all.
[[nodiscard]] double slip_walk(const std::vector<WheelDifference>& differences);

/// The same of a drive, against the gyroscope. Nothing where the wheels hardly turned.
[[nodiscard]] std::optional<double> slip_of(const Segment& segment, const RollSetting& setting);

}  // namespace ear::calibration
