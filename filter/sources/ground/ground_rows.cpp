#include "filter/sources/ground/ground_rows.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

namespace ear {
namespace {

// [m] chosen: of one hit from the line through the others; 4 mm turn it by 10 degrees.
constexpr double kMinHitDistance = 0.023;

}  // namespace

std::optional<GroundPlane> plane_through_hits(const std::vector<LaserBeam>& beams, const Eigen::Vector3d& range,
                                              const Eigen::Vector3d& p_BO) {
  if (beams.size() < 3 || !range.allFinite()) return std::nullopt;
  std::array<Eigen::Vector3d, 3> hit;
  for (std::size_t i = 0; i < 3; ++i) {
    hit[i] = beams[i].p_BL + range(static_cast<Eigen::Index>(i)) * beams[i].d_B;
  }
  const std::array<Eigen::Vector3d, 3> side = {hit[1] - hit[0], hit[2] - hit[1], hit[0] - hit[2]};
  const Eigen::Vector3d normal = side[0].cross(side[1]);  // its length is twice the triangle's area
  const double longest = std::max({side[0].norm(), side[1].norm(), side[2].norm()});
  if (normal.norm() < kMinHitDistance * longest) return std::nullopt;
  GroundPlane plane;
  plane.n_B = normal.normalized();
  plane.height = plane.n_B.dot(p_BO - hit[0]);
  if (plane.height < 0.0) {
    plane.n_B = -plane.n_B;
    plane.height = -plane.height;
  }
  return plane;
}

Slope slope(const Eigen::Vector3d& y_W, const Eigen::Vector3d& n_W) {
  const Eigen::Vector3d c = y_W.cross(n_W);
  const Eigen::Vector3d forward = c.normalized();
  const Eigen::Vector3d left = n_W.cross(forward);
  Slope result;
  result.along = std::asin(std::clamp(forward.z(), -1.0, 1.0));
  result.across = std::asin(std::clamp(left.z(), -1.0, 1.0));

  // n = Exp(theta + B delta) n^, y = Exp(theta) y^.
  Eigen::Matrix<double, 3, 5> J_y = Eigen::Matrix<double, 3, 5>::Zero();
  Eigen::Matrix<double, 3, 5> J_n;
  J_y.leftCols<3>() = -skew(y_W);
  J_n.leftCols<3>() = -skew(n_W);
  J_n.rightCols<2>() = -skew(n_W) * tangent_basis(n_W);
  const Eigen::Matrix3d unit = (Eigen::Matrix3d::Identity() - forward * forward.transpose()) / c.norm();
  const Eigen::Matrix<double, 3, 5> J_forward = unit * (skew(y_W) * J_n - skew(n_W) * J_y);
  const Eigen::Matrix<double, 3, 5> J_left = skew(n_W) * J_forward - skew(forward) * J_n;
  result.J.row(0) = J_forward.row(2) / std::cos(result.along);
  result.J.row(1) = J_left.row(2) / std::cos(result.across);
  return result;
}

namespace {
/// Derivative of the normal, in the body, by its error.
Eigen::Matrix<double, 3, 2> normal_by_error(const State& x, const Eigen::Matrix3d& R_WB, const Eigen::Vector3d& n_B) {
  return -skew(n_B) * R_WB.transpose() * tangent_basis(x.ground.n_W);
}
}  // namespace

BeamPrediction predict_range(const State& x, const Eigen::Matrix3d& R_WB, const LaserBeam& beam, double offset) {
  const Eigen::Vector3d n_B = R_WB.transpose() * x.ground.n_W;
  const Eigen::Vector3d& d_B = beam.d_B;
  const Eigen::Vector3d from_O = beam.p_BL - x.odometer.T_BO.p;
  const double slant = n_B.dot(d_B);  // negative: the beam goes down
  BeamPrediction z;
  z.range = -(x.odometer.wheel_radius.mean() + n_B.dot(from_O)) / slant;

  const Eigen::RowVector3d J_n = -(from_O + z.range * d_B).transpose() / slant;
  z.H_normal = J_n * normal_by_error(x, R_WB, n_B);
  z.H_axle = n_B.transpose() / slant;
  z.range += offset;
  return z;
}

LeanPrediction predict_lean(const State& x, const Eigen::Matrix3d& R_WB, OdometerAxis axis) {
  const Eigen::Vector3d n_B = R_WB.transpose() * x.ground.n_W;
  const Eigen::Matrix3d& R_BO = x.odometer.T_BO.R;
  const Eigen::Vector3d axis_O = Eigen::Vector3d::Unit(axis == OdometerAxis::forward ? 0 : 1);
  const Eigen::RowVector3d axis_B = (R_BO * axis_O).transpose();
  return {axis_B * n_B, axis_B * normal_by_error(x, R_WB, n_B), -n_B.transpose() * R_BO * skew(axis_O)};
}

ClimbPrediction predict_climb(const State& x) {
  const Eigen::Vector3d &n_W = x.ground.n_W, &v_W = x.imu.v_W;
  return {n_W.dot(v_W), n_W.cross(v_W).transpose() * tangent_basis(n_W), n_W.transpose()};
}

}  // namespace ear
