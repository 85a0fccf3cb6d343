#include "filter/sources/cameras/frame_check.h"

#include <cmath>

#include "filter/ekf/so3.h"
#include "filter/ingest/limits.h"
#include "filter/ingest/median.h"
#include "filter/sources/cameras/triangulation.h"

namespace ear {
namespace {

constexpr double kSigmasPerMedian = 1.4826;  // standard deviation over median absolute deviation of a normal variable

double share(int part, int of) { return of > 0 ? static_cast<double>(part) / of : 0.0; }

}  // namespace

FrameCheck::FrameCheck(double sigma_px, double focal_px) : sigma_px_(sigma_px), focal_px_(focal_px) {
  distances_.reserve(kFeatureCapacity);
}

void FrameCheck::measure_noise(const FeatureFrame& frame, const CameraState& cameras) {
  noise_ = 1.0;
  const Pose T_C1C0 = cameras.T_C0C1.inverse();
  const Eigen::Matrix3d E = skew(T_C1C0.p) * T_C1C0.R;  // right^T E left = 0
  distances_.clear();
  for (const FeatureObservation& feature : frame.features) {
    if (!feature.has_right) continue;
    const Eigen::Vector3d left = feature.left.homogeneous();
    const Eigen::Vector3d right = feature.right.homogeneous();
    const Eigen::Vector3d line = E * left;
    const double gradient = line.head<2>().squaredNorm() + (E.transpose() * right).head<2>().squaredNorm();
    if (gradient > 0.0) distances_.push_back(right.dot(line) / std::sqrt(gradient));  // to first order, Sampson's
  }
  if (distances_.size() < kToKnow) return;
  const double common = upper_median(distances_);
  for (double& distance : distances_) distance = std::abs(distance - common);
  const double ratio = kSigmasPerMedian * upper_median(distances_) * focal_px_ / sigma_px_;
  if (ratio > kNoisy) noise_ = ratio;
}

double FrameCheck::share_behind(const FeatureFrame& frame, const CameraState& cameras) const {
  const double sigma_s = stereo_inverse_depth_sigma(cameras, sigma());
  int seen = 0, behind = 0;
  for (const FeatureObservation& feature : frame.features) {
    if (!feature.has_right) continue;
    ++seen;
    behind += stereo_inverse_depth(cameras, feature.left, feature.right) < -kClear * sigma_s ? 1 : 0;
  }
  return seen < kFewFeatures ? 0.0 : share(behind, seen);
}

FrameAgreement FrameCheck::compare(const std::vector<StereoMatch>& matches, const Pose& T_B0B1, double sigma_p,
                                   const CameraState& cameras, const Gate& gate) const {
  FrameAgreement result;
  result.matches = static_cast<int>(matches.size());
  if (result.matches < kFewFeatures) return result;

  const Pose& T_BC0 = cameras.T_BC0;
  const Pose T_BC1 = T_BC0 * cameras.T_C0C1;
  const double noise = 2.0 * sigma() * sigma();
  const double sigma_s = stereo_inverse_depth_sigma(cameras, sigma());
  const double distance = T_B0B1.p.norm();
  int off_left = 0, off_right = 0, seen_right = 0;
  for (const StereoMatch& match : matches) {
    const double s = stereo_inverse_depth(cameras, match.left0, match.right0);
    // Noise of this observation and of the one that it starts from; of the depth, whose error the motion makes visible;
    // of the motion itself.
    const double variance = noise + std::pow(distance * sigma_s, 2) + std::pow(s * sigma_p, 2);
    const Eigen::Vector3d g = T_BC0.R * match.left0.homogeneous() + s * T_BC0.p;
    const Eigen::Vector3d moved = T_B0B1.R.transpose() * (g - s * T_B0B1.p);
    const auto fits = [&](const Pose& T_BC, const Eigen::Vector2d& uv) {
      const Eigen::Vector3d h = T_BC.R.transpose() * (moved - s * T_BC.p);
      return h.z() >= kLeastDepth && gate.fits((uv - h.hnormalized()).squaredNorm(), variance, 2);
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
