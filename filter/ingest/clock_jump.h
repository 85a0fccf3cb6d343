// What counts as a jump of a sensor's clock, for all of them. docs/ingest.md.
#pragma once

#include <cmath>

namespace ear {

inline constexpr double kClockJump = 0.04;        ///< [s] either way; less may be a driver that was held up
inline constexpr double kLargestClockJump = 5.0;  ///< [s] beyond that it is another clock

/// `off`: by how much a stamp is off the place where it should be [s].
[[nodiscard]] inline bool is_clock_jump(double off) {
  return std::abs(off) > kClockJump && std::abs(off) < kLargestClockJump;
}

}  // namespace ear
