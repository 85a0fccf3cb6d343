#include "tools/simulator/terrain.h"

#include <algorithm>
#include <cmath>
#include <utility>

namespace ear::simulator {
namespace {

constexpr double kFarthest = 100.0;  // [m] a ray along a wavy ground is given up here
constexpr double kClose = 1e-9;      // [m]
constexpr int kMostSteps = 400;

}  // namespace

Terrain::Terrain(std::vector<GroundWave> waves) : waves_(std::move(waves)) {
  for (const GroundWave& wave : waves_) sharpest_ += std::abs(wave.amplitude) * wave.wave_vector.squaredNorm();
}

double Terrain::height(double x, double y) const {
  double sum = 0.0;
  for (const GroundWave& wave : waves_) {
    sum += wave.amplitude * std::sin(wave.wave_vector.x() * x + wave.wave_vector.y() * y + wave.phase);
  }
  return sum;
}

Eigen::Vector2d Terrain::gradient(double x, double y) const {
  Eigen::Vector2d sum = Eigen::Vector2d::Zero();
  for (const GroundWave& wave : waves_) {
    const double argument = wave.wave_vector.x() * x + wave.wave_vector.y() * y + wave.phase;
    sum += wave.amplitude * std::cos(argument) * wave.wave_vector;
  }
  return sum;
}

Terrain::Patch Terrain::patch(double x, double y) const {
  Patch patch{0.0, Eigen::Vector2d::Zero()};
  for (const GroundWave& wave : waves_) {
    const double argument = wave.wave_vector.x() * x + wave.wave_vector.y() * y + wave.phase;
    patch.height += wave.amplitude * std::sin(argument);
    patch.gradient += wave.amplitude * std::cos(argument) * wave.wave_vector;
  }
  return patch;
}

Eigen::Vector3d Terrain::normal(double x, double y) const {
  const Eigen::Vector2d slope = gradient(x, y);
  return Eigen::Vector3d(-slope.x(), -slope.y(), 1.0).normalized();
}

double Terrain::bound() const {
  double sum = 0.0;
  for (const GroundWave& wave : waves_) sum += std::abs(wave.amplitude);
  return sum;
}

std::optional<double> Terrain::cast(const Eigen::Vector3d& origin_W, const Eigen::Vector3d& direction_W,
                                    double max_range) const {
  const double descent = -direction_W.z();
  if (flat()) {
    if (descent <= 0.0) return std::nullopt;
    const double range = origin_W.z() / descent;
    return range >= 0.0 && range <= max_range ? std::optional(range) : std::nullopt;
  }

  // The ground lies below this height: start there.
  const double top = bound();
  double range = 0.0;
  if (origin_W.z() > top) {
    if (descent <= 0.0) return std::nullopt;
    range = (origin_W.z() - top) / descent;
  }
  // gap(s) >= gap + gap' s - curving s^2 / 2 along the ray: a step to where this bound vanishes never passes the first
  // meeting, and is Newton's close to it.
  const Eigen::Vector2d along = direction_W.head<2>();
  const double curving = std::max(1e-9, sharpest_ * along.squaredNorm());
  const double farthest = std::min(max_range, kFarthest);
  for (int i = 0; i < kMostSteps && range <= farthest; ++i) {
    const Eigen::Vector3d p_W = origin_W + range * direction_W;
    if (descent <= 0.0 && p_W.z() > top) return std::nullopt;
    const Patch ground = patch(p_W.x(), p_W.y());
    const double gap = p_W.z() - ground.height;
    if (gap < -kClose) return std::nullopt;  // starts below the ground
    if (gap < kClose) return range;
    const double slope = direction_W.z() - ground.gradient.dot(along);
    const double root = std::sqrt(slope * slope + 2.0 * curving * gap);
    range += slope < 0.0 ? 2.0 * gap / (root - slope) : (slope + root) / curving;
  }
  return std::nullopt;
}

}  // namespace ear::simulator
