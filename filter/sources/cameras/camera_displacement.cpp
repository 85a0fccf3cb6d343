#include "filter/sources/cameras/camera_displacement.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>

#include "filter/ekf/so3.h"

namespace ear {
namespace {

constexpr double kMaxDepthShare = 0.25;  // standard deviation of a point's distance over the distance
constexpr double kMaxMiss = 4.0;         // of the rays, in standard deviations: not the same point
constexpr double kHuber = 1.5;           // standard deviations from which a point weighs less
constexpr double kOutlier = 4.0;         // from which it counts no more, once the rest has agreed
constexpr int kRobust = 3;               // iterations with Huber's weights
constexpr int kIterations = 5;           // and those that leave outliers out
constexpr std::size_t kMinPoints = 6;
constexpr double kMinShare = 0.3;  // of the points, that must agree

}  // namespace

/// The distance z along the ray of the first camera solves, with a = R_C1C0 (u, v, 1) and t = p_C1C0,
///   (a_x - u' a_z) z = u' t_z - t_x,   (a_y - v' a_z) z = v' t_z - t_y   in least squares.
StereoPoint stereo_point(const CameraState& camera, const FeatureObservation& feature, double sigma) {
  StereoPoint point;
  point.id = feature.id;
  if (!feature.has_right) return point;
  const Eigen::Matrix3d R_C1C0 = camera.T_C0C1.R.transpose();
  const Eigen::Vector3d t = -R_C1C0 * camera.T_C0C1.p;
  const Eigen::Vector3d ray = feature.left.homogeneous();
  const Eigen::Vector3d a = R_C1C0 * ray;
  const Eigen::Vector2d& right = feature.right;
  const Eigen::Vector2d c = a.head<2>() - right * a.z();
  const Eigen::Vector2d d = right * t.z() - t.head<2>();
  const double c2 = c.squaredNorm();
  if (!(c2 > 0.0)) return point;
  const double z = c.dot(d) / c2;
  const double miss = (c * z - d).norm() / std::abs(a.z() * z + t.z());  // in the second image
  if (!(z > 0.0) || !(miss < kMaxMiss * std::sqrt(2.0) * sigma)) return point;

  // dz = (dc.d + c.dd - 2 z c.dc) / c.c, by u, v, u', v'.
  Eigen::Matrix<double, 2, 4> J_c, J_d = Eigen::Matrix<double, 2, 4>::Zero();
  J_c.leftCols<2>() = R_C1C0.topLeftCorner<2, 2>() - right * R_C1C0.bottomLeftCorner<1, 2>();
  J_c.rightCols<2>() = -a.z() * Eigen::Matrix2d::Identity();
  J_d.rightCols<2>() = t.z() * Eigen::Matrix2d::Identity();
  const Eigen::RowVector4d J_z = (d.transpose() * J_c + c.transpose() * J_d - 2.0 * z * c.transpose() * J_c) / c2;
  if (!(sigma * J_z.norm() < kMaxDepthShare * z)) return point;
  Eigen::Matrix<double, 3, 4> J_point = ray * J_z;
  J_point.topLeftCorner<2, 2>().diagonal().array() += z;

  const Eigen::Matrix<double, 3, 4> J_B = sigma * camera.T_BC0.R * J_point;
  point.p_BF = camera.T_BC0.R * (z * ray) + camera.T_BC0.p;
  point.covariance = J_B * J_B.transpose();
  point.usable = true;
  return point;
}

CameraDisplacement::CameraDisplacement(double sigma, std::size_t max_features) : sigma_(sigma) {
  before_.reserve(max_features);
  now_.reserve(max_features);
  pairs_.reserve(max_features);
}

Displacement CameraDisplacement::add(const FeatureFrame& frame, const CameraState& camera,
                                     const Eigen::Matrix3d& R_BiBj, double rotation_variance) {
  std::swap(before_, now_);
  now_.clear();
  for (const FeatureObservation& feature : frame.features) {
    if (now_.size() == now_.capacity()) break;
    const StereoPoint point = stereo_point(camera, feature, sigma_);
    if (point.usable) now_.push_back(point);
  }
  const auto by_id = [](const StereoPoint& a, const StereoPoint& b) { return a.id < b.id; };
  if (!std::is_sorted(now_.begin(), now_.end(), by_id)) std::sort(now_.begin(), now_.end(), by_id);
  match(R_BiBj);
  return fit(rotation_variance);
}

void CameraDisplacement::match(const Eigen::Matrix3d& R_BiBj) {
  pairs_.clear();
  auto before = before_.begin();
  for (const StereoPoint& now : now_) {
    while (before != before_.end() && before->id < now.id) ++before;
    if (before == before_.end()) break;
    if (before->id != now.id) continue;
    const Eigen::Vector3d lever_Bi = R_BiBj * now.p_BF;
    const Eigen::Matrix3d S = before->covariance + R_BiBj * now.covariance * R_BiBj.transpose();
    const Eigen::Matrix3d information = S.inverse();
    if (!information.allFinite()) continue;
    pairs_.push_back({before->p_BF - lever_Bi, information, lever_Bi});
  }
}

/// Iteratively reweighted: Huber's weights from the first fit on, then without what is far off.
Displacement CameraDisplacement::fit(double rotation_variance) const {
  Displacement result;
  if (pairs_.size() < kMinPoints) return result;
  const double least = std::max(static_cast<double>(kMinPoints), kMinShare * static_cast<double>(pairs_.size()));
  Eigen::Vector3d p = Eigen::Vector3d::Zero();
  Eigen::Matrix3d information, J_rotation;
  for (int iteration = 0; iteration < kIterations; ++iteration) {
    information.setZero();
    J_rotation.setZero();
    Eigen::Vector3d weighted = Eigen::Vector3d::Zero();
    int agreeing = 0;
    for (const Pair& pair : pairs_) {
      const Eigen::Vector3d residual = pair.p_BiBj - p;
      const double distance = iteration == 0 ? 0.0 : std::sqrt(residual.dot(pair.information * residual));
      if (distance < kOutlier) ++agreeing;
      if (iteration >= kRobust && distance >= kOutlier) continue;
      const Eigen::Matrix3d W = (distance > kHuber ? kHuber / distance : 1.0) * pair.information;
      information += W;
      weighted += W * pair.p_BiBj;
      J_rotation += W * skew(pair.lever_Bi);
    }
    result.contradictory = iteration >= kRobust && agreeing < least;
    if (result.contradictory) return result;
    const Eigen::LLT<Eigen::Matrix3d> llt(information);
    if (llt.info() != Eigen::Success) return result;
    p = llt.solve(weighted);
  }
  const Eigen::Matrix3d inverse = information.ldlt().solve(Eigen::Matrix3d::Identity());
  const Eigen::Matrix3d J = inverse * J_rotation;
  result.p_BiBj = p;
  result.covariance = inverse + rotation_variance * J * J.transpose();
  result.available = p.allFinite() && result.covariance.allFinite();
  return result;
}

}  // namespace ear
