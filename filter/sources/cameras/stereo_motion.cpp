#include "filter/sources/cameras/stereo_motion.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <array>
#include <cmath>

#include "filter/ekf/so3.h"
#include "filter/ingest/capacity.h"

namespace ear {
namespace {

constexpr int kIterations = 12;
constexpr double kLeastShare = 0.6;   // of the features that fit
constexpr double kHuber = 2.0;        // [standard deviations] from where an observation weighs less
constexpr double kFits = 3.5;         // [standard deviations] of an observation that does
constexpr double kLeastDepth = 1e-3;  // of a scaled point: smaller is beside or behind the camera

/// A point of frame 0, times its inverse depth, in B0.
struct ScaledPoint {
  Eigen::Vector3d g;
  double s = 0.0;  // inverse depth [1/m]
};

ScaledPoint point_of(const StereoMatch& match, const CameraState& cameras) {
  const double s = stereo_inverse_depth(cameras, match.left0, match.right0);
  return {cameras.T_BC0.R * match.left0.homogeneous() + s * cameras.T_BC0.p, s};
}

/// Sums of one Gauss-Newton step over (rotation, translation).
struct NormalEquations {
  Eigen::Matrix<double, 6, 6> A = Eigen::Matrix<double, 6, 6>::Zero();
  Eigen::Matrix<double, 6, 1> b = Eigen::Matrix<double, 6, 1>::Zero();
};

class Problem {
 public:
  Problem(const std::vector<StereoMatch>& matches, const CameraState& cameras, double sigma)
      : matches_(matches), state_(cameras), sigma_(sigma) {
    const Pose& T_BC0 = cameras.T_BC0;
    cameras_[0] = T_BC0;
    cameras_[1] = {T_BC0.R * cameras.T_C0C1.R, T_BC0.R * cameras.T_C0C1.p + T_BC0.p};
    baseline_ = cameras.T_C0C1.p.norm();
  }

  /// One step from `x`. `fitting`: how many features fit.
  NormalEquations step(const StereoMotion& x, int& fitting) const {
    NormalEquations sums;
    fitting = 0;
    // A depth's error moves the point in frame 1 by its parallax, which is in proportion to the motion.
    const double share = std::sqrt(2.0) * x.p_B0B1.norm() / baseline_;
    const double sigma = sigma_ * std::sqrt(1.0 + share * share);
    for (const StereoMatch& match : matches_) {
      const ScaledPoint point = point_of(match, state_);  // anew in each step: cheaper than memory for all of them
      if (point.s < 0.0) continue;                        // behind the cameras
      bool fits = add(x, point, cameras_[0], match.left1, sigma, sums);
      if (match.has_right1) fits = add(x, point, cameras_[1], match.right1, sigma, sums) && fits;
      fitting += fits ? 1 : 0;
    }
    return sums;
  }

 private:
  static bool add(const StereoMotion& x, const ScaledPoint& point, const Pose& T_BC, const Eigen::Vector2d& uv,
                  double sigma, NormalEquations& sums) {
    const Eigen::Vector3d moved = x.R_B0B1.transpose() * (point.g - point.s * x.p_B0B1);
    const Eigen::Vector3d h = T_BC.R.transpose() * (moved - point.s * T_BC.p);
    if (h.z() < kLeastDepth) return false;
    const Eigen::Vector2d predicted = h.hnormalized();
    Eigen::Matrix<double, 2, 3> J_h;
    J_h << 1.0, 0.0, -predicted.x(), 0.0, 1.0, -predicted.y();
    J_h /= h.z();
    const Eigen::Matrix<double, 2, 3> J = J_h * T_BC.R.transpose();
    Eigen::Matrix<double, 2, 6> H;  // R_B0B1 Exp(theta): moved turns against it
    H.leftCols<3>() = J * skew(moved);
    H.rightCols<3>() = -point.s * J * x.R_B0B1.transpose();
    const Eigen::Vector2d r = uv - predicted;
    const double distance = r.norm() / sigma;
    const double weight = (distance > kHuber ? kHuber / distance : 1.0) / (sigma * sigma);
    sums.A.noalias() += weight * H.transpose() * H;
    sums.b.noalias() += weight * H.transpose() * r;
    return distance < kFits;
  }

  const std::vector<StereoMatch>& matches_;
  const CameraState& state_;
  double sigma_;
  double baseline_;
  std::array<Pose, 2> cameras_;  // in B
};

}  // namespace

StereoMatches::StereoMatches() {
  earlier_.reserve(kFeatureCapacity);
  matches_.reserve(kFeatureCapacity);
}

const std::vector<StereoMatch>& StereoMatches::find(const FeatureFrame& from, const FeatureFrame& to) {
  earlier_.clear();
  matches_.clear();
  for (const FeatureObservation& feature : from.features) {
    if (feature.has_right) earlier_.push_back(&feature);
  }
  const auto by_id = [](const FeatureObservation* a, const FeatureObservation* b) { return a->id < b->id; };
  std::sort(earlier_.begin(), earlier_.end(), by_id);
  for (const FeatureObservation& now : to.features) {
    const auto found = std::lower_bound(earlier_.begin(), earlier_.end(), &now, by_id);
    if (found == earlier_.end() || (*found)->id != now.id) continue;
    matches_.push_back({(*found)->left, (*found)->right, now.left, now.right, now.has_right});
  }
  return matches_;
}

double stereo_inverse_depth(const CameraState& cameras, const Eigen::Vector2d& left, const Eigen::Vector2d& right) {
  const Eigen::Matrix3d R_C1C0 = cameras.T_C0C1.R.transpose();
  const Eigen::Vector3d a = R_C1C0 * left.homogeneous();  // h = a + s b
  const Eigen::Vector3d b = -(R_C1C0 * cameras.T_C0C1.p);
  double numerator = 0.0;
  double denominator = 0.0;
  for (int k = 0; k < 2; ++k) {
    const double slope = b(k) - right(k) * b.z();
    numerator += (right(k) * a.z() - a(k)) * slope;
    denominator += slope * slope;
  }
  return denominator > 0.0 ? numerator / denominator : 0.0;
}

std::optional<StereoMotion> stereo_motion(const std::vector<StereoMatch>& matches, const CameraState& cameras,
                                          const StereoMotion& start, double sigma, double settled) {
  StereoMotion motion = start;
  motion.matches = static_cast<int>(matches.size());
  if (motion.matches < static_cast<int>(kFewestMatches)) return std::nullopt;
  const Problem problem(matches, cameras, sigma);
  for (int iteration = 0; iteration < kIterations; ++iteration) {
    const NormalEquations sums = problem.step(motion, motion.fitting);
    const Eigen::LDLT<Eigen::Matrix<double, 6, 6>> ldlt(sums.A);
    const Eigen::Matrix<double, 6, 1> step = ldlt.solve(sums.b);
    if (ldlt.info() != Eigen::Success || !step.allFinite()) return std::nullopt;
    motion.R_B0B1 = motion.R_B0B1 * exp_so3(step.head<3>());
    motion.p_B0B1 += step.tail<3>();
    motion.covariance = ldlt.solve(Eigen::Matrix<double, 6, 6>::Identity()).bottomRightCorner<3, 3>();
    if (step.norm() < settled) break;
  }
  const bool together =
      motion.fitting >= static_cast<int>(kFewestMatches) && motion.fitting >= kLeastShare * motion.matches;
  if (!together || !(motion.covariance.diagonal().minCoeff() > 0.0)) return std::nullopt;
  return motion;
}

}  // namespace ear
