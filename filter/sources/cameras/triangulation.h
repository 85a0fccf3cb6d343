// Where a feature is, from rays of known cameras.
#pragma once

#include <Eigen/Core>
#include <optional>
#include <vector>

#include "filter/ekf/state.h"

namespace ear {

/// Chosen: of a scaled point; smaller is beside or behind the camera.
inline constexpr double kLeastDepth = 1e-3;

/// One ray: a camera's pose and what it saw, normalized.
struct Sighting {
  Eigen::Matrix3d R_CW;
  Eigen::Vector3d p_WC;
  Eigen::Vector2d uv;
};

/// A point by its direction (alpha, beta, 1) in an anchor camera and its inverse depth there [1/m]; stays regular for
/// points far away.
struct InverseDepthPoint {
  Eigen::Matrix3d R_WA = Eigen::Matrix3d::Identity();
  Eigen::Vector3d p_WA = Eigen::Vector3d::Zero();
  Eigen::Vector3d bearing_A = Eigen::Vector3d::UnitZ();
  double inverse_depth = 0.0;

  /// The point times its inverse depth, in the world: finite for points at infinity.
  [[nodiscard]] Eigen::Vector3d scaled_W() const { return R_WA * bearing_A + inverse_depth * p_WA; }
};

/// Least squares over rays that see h = a + s b at `uv`: each gives uv * h.z = h.xy, linear in the inverse depth s.
struct InverseDepthSums {
  double numerator = 0.0;
  double denominator = 0.0;

  void add(const Eigen::Vector3d& a, const Eigen::Vector3d& b, const Eigen::Vector2d& uv) {
    for (int k = 0; k < 2; ++k) {
      const double slope = b(k) - uv(k) * b.z();
      numerator += (uv(k) * a.z() - a(k)) * slope;
      denominator += slope * slope;
    }
  }
  /// 0, infinitely far, if the denominator is no more than `least`.
  [[nodiscard]] double inverse_depth(double least) const { return denominator > least ? numerator / denominator : 0.0; }
};

/// Least squares over all sightings (at least two), anchored at the first: linear start, then Gauss-Newton in inverse
/// depth. Nothing if the point comes to lie behind a camera or the iteration does not settle.
[[nodiscard]] std::optional<InverseDepthPoint> triangulate(const std::vector<Sighting>& sightings);

}  // namespace ear
