#include "smoother/feature_factor.h"

#include "filter/sources/cameras/feature_update.h"
#include "smoother/factor.h"

namespace ear::smoother {
namespace {

/// Derivatives of the predicted coordinates, by steps of the blocks.
struct Prediction {
  Eigen::Vector2d residual;
  Eigen::Matrix<double, 2, 6> J_pose, J_camera, J_stereo;
  Eigen::Matrix<double, 2, 7> J_imaging;
  Eigen::Matrix<double, 2, 3> J_point;
  bool valid = false;
};

Prediction predict(const Observation& seen, const InverseDepthPoint& anchor, int which, const double* pose,
                   const double* camera, const double* stereo, const double* imaging, const double* point) {
  const Pose T_WB = to_pose(pose);
  CameraState cameras;
  set_imaging(imaging, cameras);
  const double late = cameras.time_offset - seen.time_offset;  // [s] the frame was taken after the pose's time
  const Eigen::Vector3d turn_B = seen.rate_B * late;
  const Eigen::Matrix3d R_WS = T_WB.R * exp_so3(turn_B);  // S: the body when the frame was taken
  const Eigen::Vector3d p_WS = T_WB.p + T_WB.R * seen.v_B * late;
  cameras.T_BC0 = to_pose(camera);
  if (stereo != nullptr) cameras.T_C0C1 = to_pose(stereo);
  const InverseDepthPoint feature = with_values(anchor, point);
  const LinearizedObservation z = linearize_observation({R_WS, p_WS}, cameras, which, feature, seen.uv);

  Prediction result;
  result.residual = z.residual / seen.sigma;
  result.valid = z.residual.allFinite();
  // The filter's error is R = Exp(theta) R^, p = Exp(theta) p^ + rho; here p = p^ + dp.
  const Eigen::Matrix<double, 2, 3> by_p = z.H_clone.rightCols<3>() / seen.sigma;
  const Eigen::Matrix<double, 2, 3> by_theta = z.H_clone.leftCols<3>() / seen.sigma + by_p * skew(p_WS);
  const Eigen::Vector3d v_W = T_WB.R * seen.v_B;
  result.J_pose << by_theta - by_p * skew(v_W) * late, by_p;
  result.J_imaging.setZero();
  result.J_imaging.middleCols<err::lens_size>(imaging_entry::lens + err::lens_size * which) = z.H_lens / seen.sigma;
  result.J_imaging.col(imaging_entry::time_offset) = by_theta * (T_WB.R * seen.rate_B) + by_p * v_W;
  result.J_camera = z.H_poses.leftCols<6>() / seen.sigma;
  result.J_stereo = z.H_poses.rightCols<6>() / seen.sigma;
  const Eigen::Vector3d lever_C0 = which == 0 ? Eigen::Vector3d::Zero().eval() : cameras.T_C0C1.p;
  const Eigen::Vector3d p_WC = p_WS + R_WS * (cameras.T_BC0.p + cameras.T_BC0.R * lever_C0);
  Eigen::Matrix3d by_point;  // of what the camera sees, times the inverse depth
  by_point << anchor.R_WA.leftCols<2>(), anchor.p_WA - p_WC;
  result.J_point = z.H_f * by_point / seen.sigma;
  return result;
}

void store_pose(double* target, const Eigen::Matrix<double, 2, 6>& J) {
  if (target == nullptr) return;
  Eigen::Matrix<double, 2, 7> J_block;
  J_block << -J, Eigen::Vector2d::Zero();  // of measured less predicted
  store(J_block, target);
}

bool store_all(const Prediction& z, double* residual, double** jacobians, bool right) {
  Eigen::Map<Eigen::Vector2d>(residual, 2) = z.residual;
  if (jacobians == nullptr) return z.valid;
  store_pose(jacobians[0], z.J_pose);
  store_pose(jacobians[1], z.J_camera);
  if (right) store_pose(jacobians[2], z.J_stereo);
  double* const imaging = jacobians[right ? 3 : 2];
  double* const point = jacobians[right ? 4 : 3];
  if (imaging != nullptr) store((-z.J_imaging).eval(), imaging);
  if (point != nullptr) store((-z.J_point).eval(), point);
  return z.valid;
}

}  // namespace

InverseDepthPoint with_values(const InverseDepthPoint& anchor, const double* point) {
  InverseDepthPoint result = anchor;
  result.bearing_A << point[0], point[1], 1.0;
  result.inverse_depth = point[2];
  return result;
}

PointBlock to_block(const InverseDepthPoint& point) {
  return {point.bearing_A.x(), point.bearing_A.y(), point.inverse_depth};
}

bool LeftFactor::Evaluate(double const* const* blocks, double* residual, double** jacobians) const {
  const Prediction z = predict(seen_, anchor_, 0, blocks[0], blocks[1], nullptr, blocks[2], blocks[3]);
  return store_all(z, residual, jacobians, false);
}

bool RightFactor::Evaluate(double const* const* blocks, double* residual, double** jacobians) const {
  const Prediction z = predict(seen_, anchor_, 1, blocks[0], blocks[1], blocks[2], blocks[3], blocks[4]);
  return store_all(z, residual, jacobians, true);
}

}  // namespace ear::smoother
