#include "filter/frame_check.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>

#include "filter/so3.h"

namespace ear {
namespace {

constexpr std::size_t kFewest = 8;    // features in common, for anything to be said
constexpr double kLeastDepth = 1e-3;  // of a scaled point: smaller is beside or behind the camera

double share(int part, int of) { return of > 0 ? static_cast<double>(part) / of : 0.0; }

}  // namespace

double FrameCheck::share_behind(const FeatureFrame& frame, const CameraState& cameras, double noise) const {
  const double sigma_s = std::sqrt(2.0) * noise * sigma_ / cameras.T_C0C1.p.norm();
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
  match_stereo(from, to, matches_);
  result.matches = static_cast<int>(matches_.size());
  if (matches_.size() < kFewest) return result;

  const Pose& T_BC0 = cameras.T_BC0;
  const Pose T_BC1 = {T_BC0.R * cameras.T_C0C1.R, T_BC0.R * cameras.T_C0C1.p + T_BC0.p};
  const double baseline = cameras.T_C0C1.p.norm();
  const double way = motion.p_B0B1.norm();
  int off_left = 0, off_right = 0, seen_right = 0;
  Eigen::Matrix3d A = Eigen::Matrix3d::Zero();
  Eigen::Vector3d b = Eigen::Vector3d::Zero();
  for (const StereoMatch& match : matches_) {
    const double s = stereo_inverse_depth(cameras, match.left0, match.right0);
    // Noise of this observation and of the one that it starts from; of the depth, whose error the way makes visible;
    // of the way itself.
    const double sigma_s = std::sqrt(2.0) * sigma / baseline;
    const double variance = 2.0 * sigma * sigma + std::pow(way * sigma_s, 2) + std::pow(s * motion.sigma_p, 2);
    const Eigen::Vector3d g = T_BC0.R * match.left0.homogeneous() + s * T_BC0.p;
    const Eigen::Vector3d moved = motion.R_B0B1.transpose() * (g - s * motion.p_B0B1);
    const auto residual = [&](const Pose& T_BC, const Eigen::Vector2d& uv, Eigen::Matrix<double, 2, 3>& J_turn) {
      const Eigen::Vector3d h = T_BC.R.transpose() * (moved - s * T_BC.p);
      if (h.z() < kLeastDepth) return Eigen::Vector2d::Constant(1.0).eval();
      const Eigen::Vector2d predicted = h.hnormalized();
      Eigen::Matrix<double, 2, 3> J_h;
      J_h << 1.0, 0.0, -predicted.x(), 0.0, 1.0, -predicted.y();
      J_turn = J_h / h.z() * T_BC.R.transpose() * skew(moved);
      return (uv - predicted).eval();
    };
    Eigen::Matrix<double, 2, 3> J = Eigen::Matrix<double, 2, 3>::Zero();
    const Eigen::Vector2d left = residual(T_BC0, match.left1, J);
    if (left.squaredNorm() <= gate_ * variance) {
      A += J.transpose() * J / variance;
      b += J.transpose() * left / variance;
    } else {
      ++off_left;
    }
    if (!match.has_right1) continue;
    ++seen_right;
    off_right += residual(T_BC1, match.right1, J).squaredNorm() <= gate_ * variance ? 0 : 1;
  }
  result.left = share(off_left, result.matches);
  result.right = share(off_right, seen_right);
  const double least = Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d>(A).eigenvalues()(0);
  if (least > 1.0) {
    result.turn = A.ldlt().solve(b);
    result.turn_sigma = 1.0 / std::sqrt(least);
  }
  return result;
}

}  // namespace ear
