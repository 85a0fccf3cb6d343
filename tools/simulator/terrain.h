// The ground z = h(x, y): smooth, analytic, the same for wheels, lasers and renderer.
#pragma once

#include <Eigen/Core>
#include <limits>
#include <optional>
#include <vector>

namespace ear::simulator {

/// One plane wave of the ground: amplitude * sin(wave_vector . (x, y) + phase).
struct GroundWave {
  double amplitude = 0.0;                                 ///< [m]
  Eigen::Vector2d wave_vector = Eigen::Vector2d::Zero();  ///< [rad/m]
  double phase = 0.0;                                     ///< [rad]
};

/// A sum of plane waves; without waves it is the plane z = 0. All in the world frame W.
class Terrain {
 public:
  Terrain() = default;
  explicit Terrain(std::vector<GroundWave> waves);

  [[nodiscard]] bool flat() const { return waves_.empty(); }
  [[nodiscard]] const std::vector<GroundWave>& waves() const { return waves_; }
  /// h(x, y) [m].
  [[nodiscard]] double height(double x, double y) const;
  /// (dh/dx, dh/dy).
  [[nodiscard]] Eigen::Vector2d gradient(double x, double y) const;
  /// Unit normal, upwards.
  [[nodiscard]] Eigen::Vector3d normal(double x, double y) const;
  /// No point of the ground is farther than this from z = 0 [m].
  [[nodiscard]] double bound() const;
  /// Distance along a ray (unit direction) to its first meeting with the ground, or nothing within max_range.
  [[nodiscard]] std::optional<double> cast(const Eigen::Vector3d& origin_W, const Eigen::Vector3d& direction_W,
                                           double max_range = std::numeric_limits<double>::infinity()) const;

 private:
  struct Patch {
    double height;
    Eigen::Vector2d gradient;
  };
  // Both at once, for half the time.
  [[nodiscard]] Patch patch(double x, double y) const;

  std::vector<GroundWave> waves_;
  double sharpest_ = 0.0;  // no curvature of the ground exceeds it [1/m]
};

}  // namespace ear::simulator
