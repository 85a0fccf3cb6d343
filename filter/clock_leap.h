// What counts as a leap of a sensor's clock, for all of them. docs/filter.md, section 14.
#pragma once

#include <cmath>

namespace ear {

inline constexpr double kClockLeap = 0.04;        ///< [s] either way; less may be a driver that was held up
inline constexpr double kLargestClockLeap = 5.0;  ///< [s] beyond that it is another clock

/// `off`: by how much a stamp is off the place where it should be [s].
[[nodiscard]] inline bool is_clock_leap(double off) {
  return std::abs(off) > kClockLeap && std::abs(off) < kLargestClockLeap;
}

}  // namespace ear
