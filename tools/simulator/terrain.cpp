#include "tools/simulator/terrain.h"

#include <algorithm>
#include <cmath>

namespace ear::simulator {
namespace {

constexpr double kMarchStep = 0.02;  // [m] far below the wavelengths of any ground here
constexpr double kFarthest = 100.0;  // [m] a ray along a wavy ground is given up here
constexpr int kBisections = 40;

}  // namespace

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

  const auto above = [&](double range) {
    const Eigen::Vector3d p_W = origin_W + range * direction_W;
    return p_W.z() - height(p_W.x(), p_W.y());
  };
  // The ground lies between two planes: march only between them.
  const double top = bound();
  double near = 0.0;
  double far = std::min(max_range, kFarthest);
  if (origin_W.z() > top) {
    if (descent <= 0.0) return std::nullopt;
    near = (origin_W.z() - top) / descent;
  }
  if (descent > 0.0) {
    far = std::min(far, (origin_W.z() + top) / descent + kMarchStep);
  } else if (descent < 0.0) {
    far = std::min(far, (top - origin_W.z()) / -descent);
  }
  if (above(near) < 0.0) return std::nullopt;
  while (near < far) {
    double next = std::min(near + kMarchStep, far);
    if (above(next) < 0.0) {
      for (int i = 0; i < kBisections; ++i) {
        const double middle = 0.5 * (near + next);
        (above(middle) < 0.0 ? next : near) = middle;
      }
      return near;
    }
    near = next;
  }
  return std::nullopt;
}

}  // namespace ear::simulator
