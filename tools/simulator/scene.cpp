#include "tools/simulator/scene.h"

#include <limits>

namespace ear::simulator {
namespace {

constexpr double kTouch = 1e-3;  // [m] what is nearer to a surface lies on it

// Range of a ray to a panel's front, within (0, farthest).
std::optional<double> meet(const Panel& panel, const Eigen::Vector3d& origin_W, const Eigen::Vector3d& direction_W,
                           double farthest) {
  const double approach = panel.normal_W.dot(direction_W);
  if (approach >= 0.0) return std::nullopt;
  const double range = (panel.offset - panel.normal_W.dot(origin_W)) / approach;
  if (range <= 0.0 || range >= farthest) return std::nullopt;
  return panel.contains(origin_W + range * direction_W) ? std::optional(range) : std::nullopt;
}

}  // namespace

std::optional<Hit> Scene::cast(const Eigen::Vector3d& origin_W, const Eigen::Vector3d& direction_W) const {
  Hit nearest{std::numeric_limits<double>::infinity(), kGround};
  for (std::size_t i = 0; i < panels.size(); ++i) {
    if (const auto range = meet(panels[i], origin_W, direction_W, nearest.range))
      nearest = {*range, static_cast<int>(i)};
  }
  if (const auto range = terrain.cast(origin_W, direction_W, nearest.range)) nearest = {*range, kGround};
  return std::isfinite(nearest.range) ? std::optional(nearest) : std::nullopt;
}

bool Scene::sees(const Eigen::Vector3d& from_W, const Eigen::Vector3d& to_W) const {
  for (const Panel& panel : panels) {
    const double above = panel.normal_W.dot(from_W) - panel.offset;
    const double below = panel.offset - panel.normal_W.dot(to_W);
    if (above <= 0.0 || below <= kTouch) continue;  // seen from behind, or both on one side
    if (panel.contains(from_W + above / (above + below) * (to_W - from_W))) return false;
  }
  if (terrain.flat()) return true;  // on a flat floor nothing hides behind the ground
  const double distance = (to_W - from_W).norm();
  return !terrain.cast(from_W, (to_W - from_W) / distance, distance - kTouch);
}

}  // namespace ear::simulator
