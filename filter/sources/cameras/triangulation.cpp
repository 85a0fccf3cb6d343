#include "filter/sources/cameras/triangulation.h"

#include <Eigen/Cholesky>
#include <algorithm>

namespace ear {
namespace {

constexpr int kMaxIterations = 8;                // chosen
constexpr double kSettled = 1e-10;               // chosen: squared step, in bearings and relative depth
constexpr double kNegativeInverseDepth = -0.02;  // [1/m] chosen: noise puts far points slightly beyond infinity

/// Inverse depth along the first ray for which all other rays are met best.
double linear_inverse_depth(const std::vector<Sighting>& sightings, const Eigen::Vector3d& bearing_A) {
  const Sighting& anchor = sightings.front();
  InverseDepthSums sums;
  for (std::size_t i = 1; i < sightings.size(); ++i) {
    const Sighting& s = sightings[i];
    sums.add(s.R_CW * (anchor.R_CW.transpose() * bearing_A), s.R_CW * (anchor.p_WC - s.p_WC), s.uv);
  }
  return sums.inverse_depth(1e-12);
}

}  // namespace

std::optional<InverseDepthPoint> triangulate(const std::vector<Sighting>& sightings) {
  if (sightings.size() < 2) return std::nullopt;
  const Sighting& anchor = sightings.front();
  InverseDepthPoint point;
  point.R_WA = anchor.R_CW.transpose();
  point.p_WA = anchor.p_WC;
  point.bearing_A = anchor.uv.homogeneous();
  point.inverse_depth = std::max(0.0, linear_inverse_depth(sightings, point.bearing_A));

  for (int iteration = 0; iteration < kMaxIterations; ++iteration) {
    Eigen::Matrix3d A = Eigen::Matrix3d::Zero();
    Eigen::Vector3d g = Eigen::Vector3d::Zero();
    for (const Sighting& s : sightings) {
      Eigen::Matrix3d J_h;  // columns: d h / d (alpha, beta, inverse depth)
      const Eigen::Matrix3d R_CA = s.R_CW * point.R_WA;
      J_h.leftCols<2>() = R_CA.leftCols<2>();
      J_h.col(2) = s.R_CW * (point.p_WA - s.p_WC);
      const Eigen::Vector3d h = R_CA * point.bearing_A + point.inverse_depth * J_h.col(2);
      if (h.z() < kLeastDepth) return std::nullopt;
      const double w = 1.0 / h.z();
      const Eigen::Vector2d predicted = h.head<2>() * w;
      const Eigen::Matrix<double, 2, 3> J = w * (J_h.topRows<2>() - predicted * J_h.row(2));
      A.noalias() += J.transpose() * J;
      g.noalias() += J.transpose() * (s.uv - predicted);
    }
    // The smallest damping that keeps the depth of a point at infinity defined.
    A.diagonal().array() += 1e-9 * A.trace();
    const Eigen::Vector3d step = A.ldlt().solve(g);
    if (!step.allFinite()) return std::nullopt;
    point.bearing_A.head<2>() += step.head<2>();
    point.inverse_depth += step.z();
    if (step.squaredNorm() < kSettled) break;
    if (iteration == kMaxIterations - 1 && step.squaredNorm() > 1e-4) return std::nullopt;
  }
  if (point.inverse_depth < kNegativeInverseDepth) return std::nullopt;
  return point;
}

}  // namespace ear
