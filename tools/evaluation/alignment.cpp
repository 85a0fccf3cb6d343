#include "tools/evaluation/alignment.h"

#include <Eigen/Eigenvalues>
#include <Eigen/SVD>
#include <algorithm>
#include <cmath>
#include <cstddef>

namespace ear::evaluation {
namespace {

constexpr double kSmallestSpread = 0.1;  // [m] RMS distance from the centre

using Positions = Eigen::Matrix3Xd;

Positions positions(const Trajectory& poses) {
  Positions result(3, static_cast<Eigen::Index>(poses.size()));
  for (std::size_t i = 0; i < poses.size(); ++i) result.col(static_cast<Eigen::Index>(i)) = poses[i].p_WB;
  return result;
}

Positions centred(const Positions& points) { return points.colwise() - points.rowwise().mean(); }

Eigen::Matrix3d rotation_about_z(double yaw) {
  return Eigen::AngleAxisd(yaw, Eigen::Vector3d::UnitZ()).toRotationMatrix();
}

/// How far the positions spread in the directions that tell the rotation: horizontally for yaw; for a full rotation
/// along their second principal axis, because points on a line leave the turn about it open.
double spread(AlignmentKind kind, const Positions& points) {
  const Positions p = centred(points);
  const auto count = static_cast<double>(p.cols());
  if (kind == AlignmentKind::yaw) return std::sqrt(p.topRows<2>().squaredNorm() / count);
  const Eigen::Matrix3d scatter = p * p.transpose() / count;
  return std::sqrt(std::max(0.0, Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d>(scatter).eigenvalues()(1)));
}

Eigen::Matrix3d rotation_from_positions(AlignmentKind kind, const Positions& estimate, const Positions& truth) {
  if (kind == AlignmentKind::se3) return Eigen::umeyama(estimate, truth, false).topLeftCorner<3, 3>();
  const Positions e = centred(estimate);
  const Positions t = centred(truth);
  const double sine = e.row(0).dot(t.row(1)) - e.row(1).dot(t.row(0));
  const double cosine = e.row(0).dot(t.row(0)) + e.row(1).dot(t.row(1));
  return rotation_about_z(std::atan2(sine, cosine));
}

/// The rotation A, free or about the vertical, with the largest sum of trace(A^T R_true R_est^T).
Eigen::Matrix3d rotation_from_attitude(AlignmentKind kind, const Trajectory& estimate, const Trajectory& truth) {
  Eigen::Matrix3d sum = Eigen::Matrix3d::Zero();
  for (std::size_t i = 0; i < estimate.size(); ++i)
    sum += (truth[i].q_WB * estimate[i].q_WB.conjugate()).toRotationMatrix();
  if (kind != AlignmentKind::se3) return rotation_about_z(std::atan2(sum(1, 0) - sum(0, 1), sum(0, 0) + sum(1, 1)));
  const Eigen::JacobiSVD<Eigen::Matrix3d> svd(sum, Eigen::ComputeFullU | Eigen::ComputeFullV);
  const Eigen::Matrix3d& U = svd.matrixU();
  const Eigen::Matrix3d& V = svd.matrixV();
  return U * Eigen::Vector3d(1.0, 1.0, (U * V.transpose()).determinant()).asDiagonal() * V.transpose();
}

Eigen::Isometry3d with_translation(const Eigen::Matrix3d& R_TE, const Eigen::Vector3d& p_E,
                                   const Eigen::Vector3d& p_T) {
  Eigen::Isometry3d T_TE = Eigen::Isometry3d::Identity();
  T_TE.linear() = R_TE;
  T_TE.translation() = p_T - R_TE * p_E;
  return T_TE;
}

}  // namespace

Alignment align(AlignmentKind kind, const Trajectory& estimate, const Trajectory& truth, bool has_attitude) {
  if (kind == AlignmentKind::none) return {};
  const Positions p_E = positions(estimate);
  const Positions p_T = positions(truth);
  Alignment result;
  result.rotation_from_attitude = has_attitude && std::min(spread(kind, p_E), spread(kind, p_T)) < kSmallestSpread;
  const Eigen::Matrix3d R_TE = result.rotation_from_attitude ? rotation_from_attitude(kind, estimate, truth)
                                                             : rotation_from_positions(kind, p_E, p_T);
  result.T_TE = with_translation(R_TE, p_E.rowwise().mean(), p_T.rowwise().mean());
  return result;
}

Eigen::Matrix3d yaw_from_attitudes(const Trajectory& estimate, const Trajectory& truth) {
  return rotation_from_attitude(AlignmentKind::yaw, estimate, truth);
}

Eigen::Matrix3d yaw_from_positions(const Trajectory& estimate, const Trajectory& truth) {
  return rotation_from_positions(AlignmentKind::yaw, positions(estimate), positions(truth));
}

Eigen::Isometry3d around_centre(const Eigen::Matrix3d& R_TE, const Trajectory& estimate, const Trajectory& truth) {
  return with_translation(R_TE, positions(estimate).rowwise().mean(), positions(truth).rowwise().mean());
}

Eigen::Isometry3d align_pose(AlignmentKind kind, const Pose& estimate, const Pose& truth) {
  return with_translation(rotation_from_attitude(kind, {estimate}, {truth}), estimate.p_WB, truth.p_WB);
}

}  // namespace ear::evaluation
