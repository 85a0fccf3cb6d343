#include "tools/evaluation/terrain.h"

#include <algorithm>
#include <cmath>

namespace ear::evaluation {
namespace {

std::optional<SlopeError> slope_error(const std::vector<TerrainComparison>& comparisons, double Slope::*angle) {
  SlopeError result;
  double squares = 0.0;
  std::size_t inside = 0;
  for (const TerrainComparison& c : comparisons) {
    if (!c.truth.on_ground || !c.estimate || !c.estimate->slope) continue;
    const double error = c.truth.slope.*angle - (*c.estimate->slope).*angle;
    squares += error * error;
    inside += std::abs(error) <= 3.0 * c.estimate->sigma.*angle ? 1 : 0;
    ++result.poses;
  }
  if (result.poses == 0) return std::nullopt;
  const auto count = static_cast<double>(result.poses);
  result.rmse = std::sqrt(squares / count);
  result.inside = static_cast<double>(inside) / count;
  return result;
}

}  // namespace

std::optional<TerrainTruth> terrain_at(const std::vector<TerrainTruth>& terrain, TimeNs t_ns) {
  const auto after = std::upper_bound(terrain.begin(), terrain.end(), t_ns,
                                      [](TimeNs time, const TerrainTruth& sample) { return time < sample.t_ns; });
  if (after == terrain.begin()) return std::nullopt;
  const TerrainTruth& a = *(after - 1);
  if (a.t_ns == t_ns) return a;
  if (after == terrain.end()) return std::nullopt;
  const double fraction = static_cast<double>(t_ns - a.t_ns) / static_cast<double>(after->t_ns - a.t_ns);
  const auto between = [&](double Slope::*angle) {
    return a.slope.*angle + fraction * (after->slope.*angle - a.slope.*angle);
  };
  return TerrainTruth{t_ns, a.on_ground, {between(&Slope::along), between(&Slope::across)}};
}

TerrainFigures terrain_figures(const std::vector<TerrainComparison>& comparisons) {
  TerrainFigures result;
  double squares = 0.0;
  std::size_t with_mode = 0;
  std::size_t agreeing = 0;
  for (const TerrainComparison& c : comparisons) {
    if (c.truth.on_ground) {
      ++result.ground_poses;
      squares += c.z_error * c.z_error;
    }
    if (!c.estimate) continue;
    ++with_mode;
    agreeing += c.estimate->on_ground == c.truth.on_ground ? 1 : 0;
  }
  if (result.ground_poses > 0) result.z_rmse = std::sqrt(squares / static_cast<double>(result.ground_poses));
  if (with_mode > 0) result.mode_agreement = static_cast<double>(agreeing) / static_cast<double>(with_mode);
  result.along = slope_error(comparisons, &Slope::along);
  result.across = slope_error(comparisons, &Slope::across);
  return result;
}

}  // namespace ear::evaluation
