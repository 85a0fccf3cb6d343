#include "filter/sources/cameras/frame_check.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <vector>

#include "filter/ekf/so3.h"

namespace ear {
namespace {

constexpr std::size_t kFewest = 8;  // features in common, for any result
constexpr double kLooser = 4.0;  // a wrong distance must not look like a turn: it may be wrong by more than it should
constexpr double kLeastMotion = 1e-5;  // [m]
constexpr double kLeastDepth = 1e-3;   // of a scaled point: smaller is beside or behind the camera

/// Standard deviation of an inverse depth by stereo [1/m]. `sigma`: of one observation, normalized.
double inverse_depth_sigma(double sigma, const CameraState& cameras) {
  return std::sqrt(2.0) * sigma / cameras.T_C0C1.p.norm();
}

double share(int part, int of) { return of > 0 ? static_cast<double>(part) / of : 0.0; }

}  // namespace

double FrameCheck::share_behind(const FeatureFrame& frame, const CameraState& cameras, double noise) const {
  const double sigma_s = inverse_depth_sigma(noise * sigma_, cameras);
  std::size_t seen = 0;
  int behind = 0;
  for (const FeatureObservation& feature : frame.features) {
    if (!feature.has_right) continue;
    ++seen;
    behind += stereo_inverse_depth(cameras, feature.left, feature.right) < -4.0 * sigma_s ? 1 : 0;
  }
  return seen < kFewest ? 0.0 : share(behind, static_cast<int>(seen));
}

FrameAgreement FrameCheck::compare(const FeatureFrame& from, const FeatureFrame& to, const PredictedMotion& motion,
                                   const CameraState& cameras, double noise) {
  FrameAgreement result;
  const double sigma = noise * sigma_;
  const std::vector<StereoMatch>& matches = matches_.find(from, to);
  result.matches = static_cast<int>(matches.size());
  if (matches.size() < kFewest) return result;

  const Pose& T_BC0 = cameras.T_BC0;
  const Pose T_BC1 = {T_BC0.R * cameras.T_C0C1.R, T_BC0.R * cameras.T_C0C1.p + T_BC0.p};
  const double sigma_s = inverse_depth_sigma(sigma, cameras);
  const double distance = motion.p_B0B1.norm();
  int off_left = 0, off_right = 0, seen_right = 0;
  // Of a turn and a displacement beyond the predicted ones, least squares; the latter is known to some sigma_p.
  Eigen::Matrix<double, 6, 6> A = Eigen::Matrix<double, 6, 6>::Zero();
  Eigen::Matrix<double, 6, 1> b = Eigen::Matrix<double, 6, 1>::Zero();
  for (const StereoMatch& match : matches) {
    const double s = stereo_inverse_depth(cameras, match.left0, match.right0);
    // Noise of this observation and of the one that it starts from; of the depth, whose error the motion makes visible;
    // of the motion itself.
    const double noise_variance = 2.0 * sigma * sigma + std::pow(distance * sigma_s, 2);
    const double variance = noise_variance + std::pow(s * motion.sigma_p, 2);
    const Eigen::Vector3d g = T_BC0.R * match.left0.homogeneous() + s * T_BC0.p;
    const Eigen::Vector3d moved = motion.R_B0B1.transpose() * (g - s * motion.p_B0B1);
    const auto residual = [&](const Pose& T_BC, const Eigen::Vector2d& uv, Eigen::Matrix<double, 2, 6>& J) {
      const Eigen::Vector3d h = T_BC.R.transpose() * (moved - s * T_BC.p);
      if (h.z() < kLeastDepth) return Eigen::Vector2d::Constant(1.0).eval();
      const Eigen::Vector2d predicted = h.hnormalized();
      Eigen::Matrix<double, 2, 3> J_h;
      J_h << 1.0, 0.0, -predicted.x(), 0.0, 1.0, -predicted.y();
      const Eigen::Matrix<double, 2, 3> J_moved = J_h / h.z() * T_BC.R.transpose();
      J.leftCols<3>() = J_moved * skew(moved);
      J.rightCols<3>() = -s * J_moved * motion.R_B0B1.transpose();
      return (uv - predicted).eval();
    };
    Eigen::Matrix<double, 2, 6> J = Eigen::Matrix<double, 2, 6>::Zero();
    const Eigen::Vector2d left = residual(T_BC0, match.left1, J);
    if (gate_.fits_squares(left.squaredNorm(), variance, 2)) {
      A += J.transpose() * J / noise_variance;
      b += J.transpose() * left / noise_variance;
    } else {
      ++off_left;
    }
    if (!match.has_right1) continue;
    ++seen_right;
    off_right += gate_.fits_squares(residual(T_BC1, match.right1, J).squaredNorm(), variance, 2) ? 0 : 1;
  }
  result.left = share(off_left, result.matches);
  result.right = share(off_right, seen_right);
  const double sigma_p = std::max(kLooser * motion.sigma_p, kLeastMotion);
  A.diagonal().tail<3>().array() += 1.0 / (sigma_p * sigma_p);
  const Eigen::LLT<Eigen::Matrix3d> p_llt(A.bottomRightCorner<3, 3>());
  const Eigen::Matrix3d gain = p_llt.solve(A.bottomLeftCorner<3, 3>()).transpose();
  const Eigen::Matrix3d of_turn = A.topLeftCorner<3, 3>() - gain * A.bottomLeftCorner<3, 3>();
  const double least = Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d>(of_turn).eigenvalues()(0);
  if (least > 1.0) {
    result.turn = of_turn.ldlt().solve(b.head<3>() - gain * b.tail<3>());
    result.turn_sigma = 1.0 / std::sqrt(least);
  }
  return result;
}

}  // namespace ear
