// One reading of the lasers, of fixed size.
#pragma once

#include <algorithm>
#include <array>

#include "ear/types.h"

namespace ear {

/// The most laser beams that a vehicle may have.
inline constexpr int kMaxBeams = 3;

/// Ranges of one reading of the lasers [m]; NaN without return.
struct BeamRanges {
  BeamRanges() = default;
  explicit BeamRanges(const LaserSample& sample) : t_ns(sample.t_ns) {
    std::copy_n(sample.range.begin(), std::min(sample.range.size(), range.size()), range.begin());
  }

  TimeNs t_ns = 0;
  std::array<double, kMaxBeams> range{};
};

}  // namespace ear
