#include "tools/simulator/ground_caster.h"

#include <algorithm>
#include <cmath>

#include "tools/simulator/constants.h"

namespace ear::simulator {
namespace {

constexpr float kCastTolerance = 0.01F;
constexpr int kMostSearchSteps = 1000;
constexpr float kTiny = 1e-12F;

struct SinCos {
  Lanes sin, cos;
};

// To 1e-7 and 5e-7. Reduced by a multiple of pi to [-pi/2, pi/2]; Taylor series there.
SinCos sin_cos(const Lanes& angle) {
  constexpr float kPiHead = 3.140625F;  // few bits, so that its multiples are exact
  constexpr float kPiTail = static_cast<float>(kPi - 3.140625);
  const Lanes n = rounded(angle * static_cast<float>(1.0 / kPi));
  const Lanes r = (angle - n * kPiHead) - n * kPiTail;
  const Lanes half = 0.5F * n;
  const Lanes sign = 1.0F - 4.0F * (half - rounded(half)).abs();  // -1 for odd n
  const Lanes q = r * r;
  const Lanes sin = 1.0F + q * (-1.0F / 6 + q * (1.0F / 120 + q * (-1.0F / 5040 + q * (1.0F / 362880 - q / 39916800))));
  const Lanes cos = 1.0F + q * (-1.0F / 2 + q * (1.0F / 24 + q * (-1.0F / 720 + q * (1.0F / 40320 - q / 3628800))));
  return {sign * r * sin, sign * cos};
}

Lanes horizontal_length(const RayLanes& rays) { return (rays.x * rays.x + rays.y * rays.y).sqrt(); }

}  // namespace

GroundCaster::GroundCaster(const Terrain& terrain, const Eigen::Vector3d& eye_W, float focal, float farthest)
    : eye_W_(eye_W.cast<float>()),
      top_(static_cast<float>(terrain.bound())),
      tolerance_(kCastTolerance / focal),
      farthest_(farthest) {
  for (const GroundWave& wave : terrain.waves()) {
    const double phase = wave.wave_vector.dot(eye_W.head<2>()) + wave.phase;
    waves_.push_back({static_cast<float>(wave.amplitude), static_cast<float>(wave.wave_vector.x()),
                      static_cast<float>(wave.wave_vector.y()), static_cast<float>(std::remainder(phase, 2.0 * kPi))});
    const double size = std::abs(wave.amplitude);
    const double wave_number = wave.wave_vector.norm();
    steepest_ += static_cast<float>(size * wave_number);
    sharpest_ += static_cast<float>(size * wave_number * wave_number);
    third_derivative_ += static_cast<float>(size * wave_number * wave_number * wave_number);
  }
}

GroundCaster::Ground GroundCaster::ground_below(const RayLanes& rays, const Lanes& depth) const {
  Ground ground{Lanes::Zero(), Lanes::Zero(), Lanes::Zero()};
  const Lanes x = depth * rays.x;
  const Lanes y = depth * rays.y;
  for (const Wave& wave : waves_) {
    const SinCos of = sin_cos(wave.phase + wave.x * x + wave.y * y);
    ground.height += wave.amplitude * of.sin;
    ground.slope_x += (wave.amplitude * wave.x) * of.cos;
    ground.slope_y += (wave.amplitude * wave.y) * of.cos;
  }
  return ground;
}

GroundCaster::Hits GroundCaster::cast(const RayLanes& rays, const Lanes& from) const {
  // gap(s) >= gap + gap' s - curving s^2 / 2 along the ray: a step to where this bound vanishes never passes the first
  // meeting, and is Newton's close to it.
  Lanes curving = Lanes::Zero();
  for (const Wave& wave : waves_) curving += std::abs(wave.amplitude) * (wave.x * rays.x + wave.y * rays.y).square();
  Lanes limit = Lanes::Constant(farthest_);
  for (int i = 0; i < kLanes; ++i) {  // a ray that rises is lost above the highest ground
    if (rays.z[i] > 0.0F) limit[i] = std::clamp((top_ - eye_W_.z()) / rays.z[i], 0.0F, farthest_);
  }

  Lanes depth = from.min(limit);
  Ground ground{};
  Lanes gap;
  for (int step = 0; step < kMostSearchSteps; ++step) {
    ground = ground_below(rays, depth);
    gap = eye_W_.z() + depth * rays.z - ground.height;
    const Lanes open = (gap - tolerance_ * depth).min(limit - depth);  // positive: neither met nor lost
    if (open.maxCoeff() <= 0.0F) break;
    const Lanes height = gap.max(0.0F);
    const Lanes slope = rays.z - ground.slope_x * rays.x - ground.slope_y * rays.y;
    const Lanes root = (slope.square() + 2.0F * curving * height).sqrt();
    depth = (depth + 2.0F * height / (root - slope).max(kTiny)).min(limit);
  }
  Hits hits{depth, ground.slope_x, ground.slope_y};
  for (int i = 0; i < kLanes; ++i) {
    if (!(gap[i] <= tolerance_ * depth[i])) hits.depth[i] = kMissed;
  }
  return hits;
}

Lanes GroundCaster::free_depth(const RayLanes& rays) const {
  // Far away for rays that rise: cast() limits them.
  return ((eye_W_.z() - top_) / (-rays.z).max(1e-6F)).max(0.0F);
}

Lanes GroundCaster::free_depth(const RayLanes& rays, const RayLanes& lower, const Lanes& lower_depth) const {
  Lanes depth = free_depth(rays);
  const Lanes across = horizontal_length(rays);
  const Lanes lower_across = horizontal_length(lower);
  // Elevation angles and azimuths are compared at the same distance over the ground, both multiplied by it and by the
  // lengths.
  const Lanes rise = rays.z * lower_across - lower.z * across;
  const Lanes sideways = (lower.x * rays.y - lower.y * rays.x).abs();
  const Lanes known = lower_depth * lower_across / across.max(1e-3F);
  for (int i = 0; i < kLanes; ++i) {
    if (rise[i] > steepest_ * sideways[i]) depth[i] = std::max(depth[i], known[i]);
  }
  return depth;
}

}  // namespace ear::simulator
