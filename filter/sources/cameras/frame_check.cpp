#include "filter/sources/cameras/frame_check.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include "filter/ingest/evidence.h"
#include "filter/sources/cameras/triangulation.h"

namespace ear {
namespace {

/// Standard deviation of an inverse depth by stereo [1/m]. `sigma`: of one observation, normalized.
double inverse_depth_sigma(double sigma, const CameraState& cameras) {
  return std::sqrt(2.0) * sigma / cameras.T_C0C1.p.norm();
}

double share(int part, int of) { return of > 0 ? static_cast<double>(part) / of : 0.0; }

}  // namespace

double FrameCheck::share_behind(const FeatureFrame& frame, const CameraState& cameras, double noise) const {
  const double sigma_s = inverse_depth_sigma(noise * sigma_, cameras);
  int seen = 0, behind = 0;
  for (const FeatureObservation& feature : frame.features) {
    if (!feature.has_right) continue;
    ++seen;
    behind += stereo_inverse_depth(cameras, feature.left, feature.right) < -4.0 * sigma_s ? 1 : 0;
  }
  return seen < kFewFeatures ? 0.0 : share(behind, seen);
}

FrameAgreement FrameCheck::compare(const std::vector<StereoMatch>& matches, const PredictedMotion& motion,
                                   const CameraState& cameras, double noise) const {
  FrameAgreement result;
  const double sigma = noise * sigma_;
  result.matches = static_cast<int>(matches.size());
  if (result.matches < kFewFeatures) return result;

  const Pose& T_BC0 = cameras.T_BC0;
  const Pose T_BC1 = {T_BC0.R * cameras.T_C0C1.R, T_BC0.R * cameras.T_C0C1.p + T_BC0.p};
  const double sigma_s = inverse_depth_sigma(sigma, cameras);
  const double distance = motion.p_B0B1.norm();
  int off_left = 0, off_right = 0, seen_right = 0;
  for (const StereoMatch& match : matches) {
    const double s = stereo_inverse_depth(cameras, match.left0, match.right0);
    // Noise of this observation and of the one that it starts from; of the depth, whose error the motion makes visible;
    // of the motion itself.
    const double variance = 2.0 * sigma * sigma + std::pow(distance * sigma_s, 2) + std::pow(s * motion.sigma_p, 2);
    const Eigen::Vector3d g = T_BC0.R * match.left0.homogeneous() + s * T_BC0.p;
    const Eigen::Vector3d moved = motion.R_B0B1.transpose() * (g - s * motion.p_B0B1);
    const auto fits = [&](const Pose& T_BC, const Eigen::Vector2d& uv) {
      const Eigen::Vector3d h = T_BC.R.transpose() * (moved - s * T_BC.p);
      return h.z() >= kLeastDepth && gate_.fits_squares((uv - h.hnormalized()).squaredNorm(), variance, 2);
    };
    off_left += fits(T_BC0, match.left1) ? 0 : 1;
    if (!match.has_right1) continue;
    ++seen_right;
    off_right += fits(T_BC1, match.right1) ? 0 : 1;
  }
  result.left = share(off_left, result.matches);
  result.right = share(off_right, seen_right);
  return result;
}

}  // namespace ear
