#include "tools/simulator/scene.h"

#include <limits>

namespace ear::simulator {
namespace {

// Range of a ray to a panel's front, within (0, farthest).
std::optional<double> meet(const Panel& panel, const Eigen::Vector3d& origin_W, const Eigen::Vector3d& direction_W,
                           double farthest) {
  const Eigen::Vector3d n_W = panel.normal_W();
  const double approach = n_W.dot(direction_W);
  if (approach >= 0.0) return std::nullopt;
  const double range = n_W.dot(panel.corner_W - origin_W) / approach;
  if (range <= 0.0 || range >= farthest) return std::nullopt;
  const Eigen::Vector3d q_W = origin_W + range * direction_W - panel.corner_W;
  const double a = q_W.dot(panel.u_W);
  const double b = q_W.dot(panel.v_W);
  const bool inside = a >= 0.0 && b >= 0.0 && a <= panel.width && b <= panel.height;
  return inside ? std::optional(range) : std::nullopt;
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
  const double distance = (to_W - from_W).norm();
  const Eigen::Vector3d direction_W = (to_W - from_W) / distance;
  const double farthest = distance - 1e-3;
  for (const Panel& panel : panels) {
    if (meet(panel, from_W, direction_W, farthest)) return false;
  }
  // On a flat floor nothing hides behind the ground.
  return terrain.flat() || !terrain.cast(from_W, direction_W, farthest);
}

}  // namespace ear::simulator
