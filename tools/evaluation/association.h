// Which truth belongs to which estimated pose, in integer nanoseconds.
#pragma once

#include <cstddef>
#include <vector>

#include "tools/evaluation/trajectory.h"

namespace ear::evaluation {

/// An estimated pose and the truth at its time.
struct Match {
  std::size_t index = 0;  ///< into the estimate
  Pose truth;             ///< interpolated, with the estimate's time
  int segment = 0;        ///< counts up at each gap of the estimate or of the truth: same number, no gap between
};

struct Association {
  std::vector<Match> matches;
  std::size_t outside = 0;  ///< estimated poses before the first or after the last truth
  std::size_t in_gaps = 0;  ///< estimated poses inside a gap of the truth
};

/// An interval between neighbouring poses that is longer than this is a gap: three times the median interval, but at
/// least 0.1 s. One pose has no interval: 0.1 s.
[[nodiscard]] TimeNs gap_limit(const Trajectory& trajectory);

/// The pose at t_ns, a.t_ns <= t_ns <= b.t_ns: position linear, rotation on the shorter arc (slerp).
[[nodiscard]] Pose interpolate(const Pose& a, const Pose& b, TimeNs t_ns);

/// Truth at every estimated time that it covers; never extrapolated, never across one of its gaps.
[[nodiscard]] Association associate(const Trajectory& estimate, const Trajectory& truth);

/// Time of the trajectory without its gaps [s].
[[nodiscard]] double known_time(const Trajectory& trajectory);

/// Share of the truth's time, its gaps left out, in which the estimate runs without a gap. In [0, 1].
[[nodiscard]] double coverage(const Trajectory& estimate, const Trajectory& truth);

}  // namespace ear::evaluation
