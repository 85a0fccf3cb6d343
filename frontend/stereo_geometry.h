// What two calibrated cameras measure of one point: transfer across the pair, inverse depth, distance to the epipolar
// line.
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <optional>

namespace ear {

/// Where a point of one camera is seen by another. `inverse_depth` is 1/z [1/m] in the first camera; 0 is infinity.
struct Transfer {
  Eigen::Matrix3d R_10 = Eigen::Matrix3d::Identity();
  Eigen::Vector3d p_10 = Eigen::Vector3d::Zero();  ///< position of the first camera in the second [m]

  /// The point in the second camera, scaled by its inverse depth in the first: z is the ratio of the two depths.
  [[nodiscard]] Eigen::Vector3d scaled_point(const Eigen::Vector2d& x0, double inverse_depth) const {
    return R_10 * x0.homogeneous() + inverse_depth * p_10;
  }
};

/// A matched pair of rays, read as a point.
struct StereoPoint {
  double inverse_depth = 0.0;      ///< 1/z in the left camera [1/m]; noise makes it negative for very far points
  double epipolar_distance = 0.0;  ///< distance of the right ray from the epipolar line, normalized coordinates
};

/// What is thought of an inverse depth before [1/m]; `weight`: of that in the sum of squares, where the error in
/// normalized coordinates counts once.
struct DepthPrior {
  double inverse_depth = 0.0;
  double weight = 0.0;
};

/// The inverse depth that brings `x0` closest to `x1`; nothing if the pair of rays shows no depth and nothing is
/// thought of it before.
[[nodiscard]] inline std::optional<StereoPoint> intersect(const Transfer& stereo, const Eigen::Vector2d& x0,
                                                          const Eigen::Vector2d& x1, const DepthPrior& prior = {}) {
  // (R x0 + rho p).xy - x1 (R x0 + rho p).z = 0 is linear in rho: two equations, one unknown.
  const Eigen::Vector3d far = stereo.R_10 * x0.homogeneous();
  const Eigen::Vector2d offset = far.head<2>() - x1 * far.z();
  const Eigen::Vector2d slope = stereo.p_10.head<2>() - x1 * stereo.p_10.z();
  const double information = slope.squaredNorm() + prior.weight;
  if (!(information > 1e-12)) return std::nullopt;
  const double inverse_depth = (prior.weight * prior.inverse_depth - slope.dot(offset)) / information;
  const double z = far.z() + inverse_depth * stereo.p_10.z();
  if (!(z > 1e-6)) return std::nullopt;
  return StereoPoint{inverse_depth, (offset + inverse_depth * slope).norm() / z};
}

}  // namespace ear
