// One reading of the lasers, of fixed size.
#pragma once

#include <algorithm>
#include <array>
#include <bitset>
#include <limits>

#include "ear/calibration.h"
#include "ear/types.h"

namespace ear {

/// The most laser beams that a vehicle may have.
inline constexpr int kMaxBeams = 3;

/// Is it a range, within its limits? Not NaN.
[[nodiscard]] inline bool is_return(double range, const LaserCalibration& lasers) {
  return range >= lasers.range_min && range <= lasers.range_max;
}

/// Ranges of one reading of the lasers [m]; NaN without a new return, and out of their limits.
struct BeamRanges {
  BeamRanges() = default;
  BeamRanges(const LaserSample& sample, const LaserCalibration& lasers, const std::bitset<kMaxBeams>& repeating = {})
      : t_ns(sample.t_ns) {
    for (std::size_t i = 0; i < std::min(sample.range.size(), range.size()); ++i) {
      const bool is_new = is_return(sample.range[i], lasers) && !repeating[i];
      range[i] = is_new ? sample.range[i] : std::numeric_limits<double>::quiet_NaN();
    }
  }

  TimeNs t_ns = 0;
  std::array<double, kMaxBeams> range{};
};

}  // namespace ear
