// Numbers that are worked on together, one per ray: loops that the processor takes four at a time.
#pragma once

#include <Eigen/Core>

namespace ear::simulator {

inline constexpr int kLanes = 8;
using Lanes = Eigen::Array<float, kLanes, 1>;

/// The nearest whole numbers, for |x| < 2^22: the sum has no bits left for a fraction.
[[nodiscard]] inline Lanes rounded(const Lanes& x) {
  constexpr float kShift = 12582912.0F;  // 1.5 * 2^23
  return (x + kShift) - kShift;
}

}  // namespace ear::simulator
