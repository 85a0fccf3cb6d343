#include "frontend/motion_of_flows.h"

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <Eigen/Geometry>
#include <algorithm>

namespace ear {
namespace {

using Vector6d = Eigen::Matrix<double, 6, 1>;
using Matrix6d = Eigen::Matrix<double, 6, 6>;

void turn(Eigen::Matrix3d& R, const Eigen::Vector3d& by) {
  const double angle = by.norm();
  if (angle > 1e-12) R = Eigen::AngleAxisd(angle, by / angle).toRotationMatrix() * R;
}

}  // namespace

std::optional<Transfer> refine_motion(const std::vector<Flow>& flows, const std::vector<std::uint8_t>& used,
                                      Transfer motion, int steps, double settled) {
  double nearest = 0.0;  // inverse depth
  for (int step = 0; step < steps; ++step) {
    Matrix6d information = Matrix6d::Zero();
    Vector6d gradient = Vector6d::Zero();
    for (std::size_t i = 0; i < flows.size(); ++i) {
      const Flow& flow = flows[i];
      if (!used[i] || !flow.has_depth) continue;
      nearest = std::max(nearest, flow.inverse_depth0);
      const Eigen::Vector3d point = motion.scaled_point(flow.x0, flow.inverse_depth0);
      if (!(point.z() > 1e-3)) continue;
      const double inverse_z = 1.0 / point.z();
      const Eigen::Vector2d at = point.head<2>() * inverse_z;
      Eigen::Matrix<double, 2, 3> J_at_point;
      J_at_point << inverse_z, 0.0, -at.x() * inverse_z, 0.0, inverse_z, -at.y() * inverse_z;
      const Eigen::Vector3d turned = point - flow.inverse_depth0 * motion.p_10;
      Eigen::Matrix3d minus_skew;
      minus_skew << 0.0, turned.z(), -turned.y(), -turned.z(), 0.0, turned.x(), turned.y(), -turned.x(), 0.0;
      Eigen::Matrix<double, 2, 6> J;
      J << J_at_point * minus_skew, flow.inverse_depth0 * J_at_point;
      const Eigen::Vector2d error = flow.x1 - at;
      information.noalias() += J.transpose() * J;
      gradient.noalias() += J.transpose() * error;
    }
    information.diagonal().array() += 1e-9;
    const Vector6d change = information.llt().solve(gradient);
    if (!change.allFinite()) return std::nullopt;
    const double angle = change.head<3>().norm();
    turn(motion.R_10, change.head<3>());
    motion.p_10 += change.tail<3>();
    // What is left after a step is of the order of its square. No flow moves further than the angle and the translation
    // in units of its depth.
    if (angle + nearest * change.tail<3>().norm() < settled) break;
  }
  return motion;
}

// The first direction is the one most nearly perpendicular to the normals of all planes.
std::optional<Transfer> refine_turn(const std::vector<Flow>& flows, const std::vector<std::uint8_t>& used,
                                    Transfer motion, int steps) {
  Eigen::Matrix3d normals = Eigen::Matrix3d::Zero();
  for (std::size_t i = 0; i < flows.size(); ++i) {
    if (!used[i]) continue;
    const Eigen::Vector3d n = flows[i].x1.homogeneous().cross(motion.R_10 * flows[i].x0.homogeneous());
    normals += n * n.transpose();
  }
  Eigen::Vector3d& p = motion.p_10;
  p = Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d>(normals).eigenvectors().col(0);
  for (int step = 0; step < steps; ++step) {
    Matrix6d information = 1e-9 * Matrix6d::Identity();
    Vector6d gradient = Vector6d::Zero();
    for (std::size_t i = 0; i < flows.size(); ++i) {
      if (!used[i]) continue;
      const Eigen::Vector3d turned = motion.R_10 * flows[i].x0.homogeneous();
      const Eigen::Vector3d found = flows[i].x1.homogeneous();
      const Eigen::Vector3d normal = found.cross(turned);
      Vector6d J;
      J << turned.cross(p.cross(found)), normal;
      // The residual over this is the distance from the epipolar line.
      const double weight = 1.0 / (1e-6 + p.cross(turned).head<2>().squaredNorm());
      information.noalias() += weight * J * J.transpose();
      gradient.noalias() -= weight * p.dot(normal) * J;
    }
    information.bottomRightCorner<3, 3>() += p * p.transpose() * information.trace();  // its length stays
    const Vector6d change = information.llt().solve(gradient);
    if (!change.allFinite()) return std::nullopt;
    turn(motion.R_10, change.head<3>());
    p = (p + change.tail<3>()).normalized();
  }
  return motion;
}

// Linear, two equations each.
std::optional<Eigen::Vector3d> solve_translation(const std::vector<Flow>& flows, std::size_t a, std::size_t b,
                                                 const Eigen::Matrix3d& R_10) {
  Eigen::Matrix3d information = 1e-9 * Eigen::Matrix3d::Identity();
  Eigen::Vector3d right = Eigen::Vector3d::Zero();
  for (const std::size_t i : {a, b}) {
    const Flow& flow = flows[i];
    const Eigen::Vector3d far = R_10 * flow.x0.homogeneous();
    Eigen::Matrix<double, 2, 3> J;
    J << 1.0, 0.0, -flow.x1.x(), 0.0, 1.0, -flow.x1.y();
    information.noalias() += flow.inverse_depth0 * flow.inverse_depth0 * J.transpose() * J;
    right.noalias() -= flow.inverse_depth0 * J.transpose() * (J * far);
  }
  const Eigen::Vector3d p = information.llt().solve(right);
  if (!p.allFinite()) return std::nullopt;
  return p;
}

std::optional<Eigen::Vector3d> solve_direction(const std::vector<Flow>& flows, std::size_t a, std::size_t b,
                                               const Eigen::Matrix3d& R_10) {
  const auto plane_normal = [&](const Flow& flow) -> Eigen::Vector3d {
    return flow.x1.homogeneous().cross(R_10 * flow.x0.homogeneous());
  };
  const Eigen::Vector3d p = plane_normal(flows[a]).cross(plane_normal(flows[b]));
  const double length = p.norm();
  if (!(length > 1e-12)) return std::nullopt;
  return p / length;
}

}  // namespace ear
