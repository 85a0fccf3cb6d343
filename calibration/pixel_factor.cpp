#include "calibration/pixel_factor.h"

#include <ceres/jet.h>

#include "filter/sources/cameras/feature_update.h"
#include "smoother/factor.h"
#include "smoother/feature_factor.h"

namespace ear::calibration {
namespace {

/// A pixel, and its derivatives by the normalized coordinates and by the lens.
struct Projected {
  Eigen::Vector2d px;
  Eigen::Matrix2d by_xy;
  Eigen::Matrix<double, 2, 5> by_lens;
};

Projected project(const CameraCalibration& camera, const double* lens, const Eigen::Vector2d& xy) {
  using Jet = ceres::Jet<double, 7>;
  const Eigen::Matrix<Jet, 2, 1> point{Jet(xy.x(), 0), Jet(xy.y(), 1)};
  std::array<Jet, 5> error;
  for (int k = 0; k < 5; ++k) error[static_cast<std::size_t>(k)] = Jet(lens[k], 2 + k);
  const Eigen::Matrix<Jet, 2, 1> pixel = to_pixel(camera, error, point);
  Projected result;
  for (int row = 0; row < 2; ++row) {
    result.px(row) = pixel(row).a;
    result.by_xy.row(row) = pixel(row).v.head<2>().transpose();
    result.by_lens.row(row) = pixel(row).v.tail<5>().transpose();
  }
  return result;
}

struct Blocks {
  const double *pose, *camera, *stereo, *lens, *time, *point;
};

/// Derivatives of the predicted pixel.
struct Prediction {
  Eigen::Vector2d px;
  Eigen::Matrix<double, 2, 6> J_pose, J_camera, J_stereo;
  Eigen::Matrix<double, 2, 5> J_lens;
  Eigen::Vector2d J_time;
  Eigen::Matrix<double, 2, 3> J_point;
  bool valid = false;
};

/// Additive steps of the block's rotation vector turn it by the left Jacobian.
Eigen::Matrix<double, 2, 6> by_block(const Eigen::Matrix<double, 2, 6>& J, const double* error) {
  Eigen::Matrix<double, 2, 6> result = J;
  result.leftCols<3>() = J.leftCols<3>() * gamma<1>(Eigen::Map<const Eigen::Vector3d>(error));
  return result;
}

Prediction predict(const PixelObservation& seen, const GivenCameras& given, const InverseDepthPoint& anchor, int which,
                   const Blocks& b) {
  const Pose T_WB = smoother::to_pose(b.pose);
  const double late = seen.late + b.time[0];
  const Eigen::Matrix3d R_WS = T_WB.R * exp_so3(seen.rate_B * late);  // S: the body when the frame was taken
  const Eigen::Vector3d v_W = T_WB.R * seen.v_B;
  const Eigen::Vector3d p_WS = T_WB.p + v_W * late;
  CameraState cameras;
  cameras.T_BC0 = with_error(given.poses.T_BC0, b.camera);
  if (b.stereo != nullptr) cameras.T_C0C1 = with_error(given.poses.T_C0C1, b.stereo);
  const InverseDepthPoint feature = smoother::with_values(anchor, b.point);
  const LinearizedObservation z = linearize_observation({R_WS, p_WS}, cameras, which, feature, Eigen::Vector2d::Zero());

  Prediction result;
  const Projected pixel = project(given.lens[static_cast<std::size_t>(which)], b.lens, -z.residual);
  const Eigen::Matrix2d& D = pixel.by_xy;
  result.px = pixel.px;
  result.valid = z.residual.allFinite() && pixel.px.allFinite();
  result.J_lens = pixel.by_lens;
  // The filter's error is R = Exp(theta) R^, p = Exp(theta) p^ + rho; here p = p^ + dp.
  const Eigen::Matrix<double, 2, 3> by_p = D * z.H_clone.rightCols<3>();
  const Eigen::Matrix<double, 2, 3> by_theta = D * z.H_clone.leftCols<3>() + by_p * skew(p_WS);
  result.J_pose << by_theta - by_p * skew(v_W) * late, by_p;
  result.J_time = by_theta * (T_WB.R * seen.rate_B) + by_p * v_W;
  result.J_camera = by_block(D * z.H_poses.leftCols<6>(), b.camera);
  if (b.stereo != nullptr) result.J_stereo = by_block(D * z.H_poses.rightCols<6>(), b.stereo);
  const Eigen::Vector3d lever_C0 = which == 0 ? Eigen::Vector3d::Zero().eval() : cameras.T_C0C1.p;
  const Eigen::Vector3d p_WC = p_WS + R_WS * (cameras.T_BC0.p + cameras.T_BC0.R * lever_C0);
  Eigen::Matrix3d by_point;  // of what the camera sees, times the inverse depth
  by_point << anchor.R_WA.leftCols<2>(), anchor.p_WA - p_WC;
  result.J_point = D * z.H_f * by_point;
  return result;
}

/// Of measured less predicted.
template <typename Matrix>
void store_negative(const Matrix& J, double sigma, double* target) {
  if (target != nullptr) smoother::store((-J / sigma).eval(), target);
}

void store_pose(const Eigen::Matrix<double, 2, 6>& J, double sigma, double* target) {
  Eigen::Matrix<double, 2, 7> J_block;
  J_block << J, Eigen::Vector2d::Zero();
  store_negative(J_block, sigma, target);
}

}  // namespace

Pose with_error(const Pose& given, const double* error) {
  return {exp_so3(Eigen::Map<const Eigen::Vector3d>(error)) * given.R,
          given.p + Eigen::Map<const Eigen::Vector3d>(error + 3)};
}

bool LeftPixel::Evaluate(double const* const* blocks, double* residual, double** jacobians) const {
  const Prediction z =
      predict(seen_, given_, anchor_, 0, {blocks[0], blocks[1], nullptr, blocks[2], blocks[3], blocks[4]});
  Eigen::Map<Eigen::Vector2d>(residual, 2) = (seen_.px - z.px) / seen_.sigma;
  if (jacobians == nullptr) return z.valid;
  store_pose(z.J_pose, seen_.sigma, jacobians[0]);
  store_negative(z.J_camera, seen_.sigma, jacobians[1]);
  store_negative(z.J_lens, seen_.sigma, jacobians[2]);
  store_negative(z.J_time, seen_.sigma, jacobians[3]);
  store_negative(z.J_point, seen_.sigma, jacobians[4]);
  return z.valid;
}

bool RightPixel::Evaluate(double const* const* blocks, double* residual, double** jacobians) const {
  const Prediction z =
      predict(seen_, given_, anchor_, 1, {blocks[0], blocks[1], blocks[2], blocks[3], blocks[4], blocks[5]});
  Eigen::Map<Eigen::Vector2d>(residual, 2) = (seen_.px - z.px) / seen_.sigma;
  if (jacobians == nullptr) return z.valid;
  store_pose(z.J_pose, seen_.sigma, jacobians[0]);
  store_negative(z.J_camera, seen_.sigma, jacobians[1]);
  store_negative(z.J_stereo, seen_.sigma, jacobians[2]);
  store_negative(z.J_lens, seen_.sigma, jacobians[3]);
  store_negative(z.J_time, seen_.sigma, jacobians[4]);
  store_negative(z.J_point, seen_.sigma, jacobians[5]);
  return z.valid;
}

}  // namespace ear::calibration
