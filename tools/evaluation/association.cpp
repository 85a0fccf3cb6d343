#include "tools/evaluation/association.h"

#include <algorithm>
#include <limits>

namespace ear::evaluation {
namespace {

constexpr TimeNs kShortestGap = 100'000'000;  // [ns] a vehicle moves smoothly enough to interpolate over less

/// For every pose, how many gaps lie before it.
std::vector<int> gaps_before(const Trajectory& trajectory) {
  const TimeNs limit = gap_limit(trajectory);
  std::vector<int> counts(trajectory.size(), 0);
  for (std::size_t i = 1; i < trajectory.size(); ++i)
    counts[i] = counts[i - 1] + (trajectory[i].t_ns - trajectory[i - 1].t_ns > limit ? 1 : 0);
  return counts;
}

struct Interval {
  TimeNs from_ns = 0, to_ns = 0;
  [[nodiscard]] TimeNs length() const { return to_ns - from_ns; }
};

/// Between its gaps, in order.
std::vector<Interval> runs(const Trajectory& trajectory) {
  const std::vector<int> gaps = gaps_before(trajectory);
  std::vector<Interval> result;
  for (std::size_t i = 0; i < trajectory.size(); ++i) {
    const TimeNs t_ns = trajectory[i].t_ns;
    if (i == 0 || gaps[i] != gaps[i - 1]) result.push_back({t_ns, t_ns});
    result.back().to_ns = t_ns;
  }
  return result;
}

}  // namespace

TimeNs gap_limit(const Trajectory& trajectory) {
  if (trajectory.size() < 2) return kShortestGap;
  std::vector<TimeNs> intervals;
  for (std::size_t i = 1; i < trajectory.size(); ++i) intervals.push_back(trajectory[i].t_ns - trajectory[i - 1].t_ns);
  const auto middle = intervals.begin() + static_cast<std::ptrdiff_t>(intervals.size() / 2);
  std::nth_element(intervals.begin(), middle, intervals.end());
  constexpr TimeNs kLongestGap = std::numeric_limits<TimeNs>::max() / 3;
  return std::max(kShortestGap, 3 * std::min(*middle, kLongestGap));
}

Pose interpolate(const Pose& a, const Pose& b, TimeNs t_ns) {
  if (t_ns == a.t_ns) return a;
  const double fraction = static_cast<double>(t_ns - a.t_ns) / static_cast<double>(b.t_ns - a.t_ns);
  return {t_ns, a.q_WB.slerp(fraction, b.q_WB), a.p_WB + fraction * (b.p_WB - a.p_WB)};
}

Association associate(const Trajectory& estimate, const Trajectory& truth) {
  const std::vector<int> truth_gaps = gaps_before(truth);
  const std::vector<int> estimate_gaps = gaps_before(estimate);
  Association result;
  for (std::size_t i = 0; i < estimate.size(); ++i) {
    const TimeNs t_ns = estimate[i].t_ns;
    const auto after = std::lower_bound(truth.begin(), truth.end(), t_ns,
                                        [](const Pose& pose, TimeNs time) { return pose.t_ns < time; });
    if (after == truth.end() || (after == truth.begin() && after->t_ns != t_ns)) {
      ++result.outside;
      continue;
    }
    const auto b = static_cast<std::size_t>(after - truth.begin());
    const std::size_t a = after->t_ns == t_ns ? b : b - 1;
    if (truth_gaps[a] != truth_gaps[b]) {
      ++result.in_gaps;
      continue;
    }
    // Both counts only grow, so their sum stays the same exactly where neither grows.
    result.matches.push_back({i, interpolate(truth[a], truth[b], t_ns), truth_gaps[a] + estimate_gaps[i]});
  }
  return result;
}

double known_time(const Trajectory& trajectory) {
  TimeNs known = 0;
  for (const Interval& run : runs(trajectory)) known += run.length();
  return 1e-9 * static_cast<double>(known);
}

double coverage(const Trajectory& estimate, const Trajectory& truth) {
  const std::vector<Interval> estimated = runs(estimate);
  TimeNs known = 0, covered = 0;
  auto first = estimated.begin();
  for (const Interval& run : runs(truth)) {
    known += run.length();
    while (first != estimated.end() && first->to_ns <= run.from_ns) ++first;
    for (auto it = first; it != estimated.end() && it->from_ns < run.to_ns; ++it)
      covered += Interval{std::max(it->from_ns, run.from_ns), std::min(it->to_ns, run.to_ns)}.length();
  }
  return known == 0 ? 0.0 : static_cast<double>(covered) / static_cast<double>(known);
}

}  // namespace ear::evaluation
