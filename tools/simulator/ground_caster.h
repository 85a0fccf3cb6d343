// Rays against a wavy ground, many at once: what Terrain::cast() does, in single precision, for the renderer.
#pragma once

#include <Eigen/Core>
#include <limits>
#include <vector>

#include "tools/simulator/lanes.h"
#include "tools/simulator/terrain.h"

namespace ear::simulator {

/// Rays from the camera's centre, p_W(depth) = eye_W + depth * (x, y, z). `depth` is the third coordinate in the
/// camera's frame, so these directions are not unit vectors.
struct RayLanes {
  Lanes x, y, z;
};

/// Depth of a ray that misses the ground.
inline constexpr float kMissed = std::numeric_limits<float>::infinity();

/// Casts rays from one eye. Depths are exact to a hundredth of a pixel: that high may a ray still be over the ground.
class GroundCaster {
 public:
  /// focal: [px]. Rays that go farther than `farthest` [m] of depth miss.
  GroundCaster(const Terrain& terrain, const Eigen::Vector3d& eye_W, float focal, float farthest);

  struct Hits {
    Lanes depth;             ///< [m], or kMissed
    Lanes slope_x, slope_y;  ///< of the ground there, dh/dx and dh/dy
  };
  /// First meetings with the ground. None of the rays may meet the ground before its depth in `from`.
  [[nodiscard]] Hits cast(const RayLanes& rays, const Lanes& from) const;

  /// How far each ray is free when another one, `lower`, is free up to `lower_depth` (kMissed: everywhere). That is
  /// known when the ray rises more over the other than the ground can rise on the way across; otherwise it is the depth
  /// at which the ray comes down to where ground may be.
  [[nodiscard]] Lanes free_depth(const RayLanes& rays, const RayLanes& lower, const Lanes& lower_depth) const;
  /// The latter.
  [[nodiscard]] Lanes free_depth(const RayLanes& rays) const;

  [[nodiscard]] const Eigen::Vector3f& eye_W() const { return eye_W_; }
  /// No slope of the ground exceeds this.
  [[nodiscard]] float steepest() const { return steepest_; }
  /// No curvature of the ground exceeds this [1/m].
  [[nodiscard]] float sharpest() const { return sharpest_; }
  /// No third derivative of the ground's height along any direction exceeds this [1/m^2].
  [[nodiscard]] float third_derivative() const { return third_derivative_; }

 private:
  struct Wave {
    float amplitude, x, y;  // [m], [rad/m]
    float phase;            // at the eye [rad]
  };
  struct Ground {
    Lanes height, slope_x, slope_y;
  };
  [[nodiscard]] Ground ground_below(const RayLanes& rays, const Lanes& depth) const;

  std::vector<Wave> waves_;
  Eigen::Vector3f eye_W_;
  float top_ = 0.0F;  // no ground is higher [m]
  float tolerance_;   // [m] of height per metre of depth
  float farthest_;
  float steepest_ = 0.0F, sharpest_ = 0.0F, third_derivative_ = 0.0F;
};

}  // namespace ear::simulator
