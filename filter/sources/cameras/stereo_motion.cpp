#include "filter/sources/cameras/stereo_motion.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>

#include "filter/ekf/so3.h"
#include "filter/ingest/limits.h"
#include "filter/kernels/filter_kernels.h"
#include "filter/sources/cameras/frame_agreement.h"
#include "filter/sources/cameras/triangulation.h"

namespace ear {
namespace {

constexpr int kIterations = 50;  // chosen: from where samples that are missing leave the motion, some 20

/// Sums of one Gauss-Newton step over (rotation, translation).
struct NormalEquations {
  Eigen::Matrix<double, 6, 6> A = Eigen::Matrix<double, 6, 6>::Zero();
  Eigen::Matrix<double, 6, 1> b = Eigen::Matrix<double, 6, 1>::Zero();
};

/// The sums of a camera's kernel, which are over a turn and a shift of the points in it: dh = [h]x theta - s tau.
NormalEquations equations_of(const StereoSums& sums) {
  NormalEquations equations;
  const double* entry = sums.A;
  for (Eigen::Index column = 0; column < 6; ++column) {
    for (Eigen::Index row = column; row < 6; ++row, ++entry) {
      equations.A(row, column) = equations.A(column, row) = *entry;
    }
    equations.b(column) = sums.b[column];
  }
  return equations;
}

PlainPose plain(const Pose& T) {
  PlainPose pose;
  Eigen::Map<Eigen::Matrix<double, 3, 3, Eigen::RowMajor>>(pose.R) = T.R;
  Eigen::Map<Eigen::Vector3d>(pose.p) = T.p;
  return pose;
}

/// The matches as the kernels read them.
StereoTable table_of(const std::vector<StereoMatch>& matches) {
  static_assert(offsetof(StereoMatch, left0) == 0 && offsetof(StereoMatch, right0) == 2 * sizeof(double) &&
                offsetof(StereoMatch, left1) == 4 * sizeof(double) &&
                offsetof(StereoMatch, right1) == 6 * sizeof(double) && sizeof(StereoMatch) % sizeof(double) == 0);
  return {matches.front().left0.data(), sizeof(StereoMatch) / sizeof(double), &matches.front().has_right1,
          static_cast<int>(matches.size())};
}

/// The s with which h = a + s b is best seen at `right`.
double inverse_depth(const Eigen::Vector3d& a, const Eigen::Vector3d& b, const Eigen::Vector2d& right) {
  InverseDepthSums sums;
  sums.add(a, b, right);
  return sums.inverse_depth(0.0);
}

class Problem {
 public:
  Problem(const std::vector<StereoMatch>& matches, const CameraState& cameras, double sigma, Kernels kernels)
      : kernels_(filter_kernels(kernels)),
        table_(table_of(matches)),
        sigma_(sigma),
        baseline_(cameras.T_C0C1.p.norm()) {
    T_BC_ = {cameras.T_BC0, cameras.T_BC0 * cameras.T_C0C1};
    plain_.right0 = plain(cameras.T_C0C1.inverse());
    plain_.huber = kHuber;
    plain_.fits = kClear;
    plain_.least_depth = kLeastDepth;
  }

  /// One step from `x`. `fitting`: how many features fit.
  NormalEquations step(const Pose& T_B0B1, int& fitting) {
    // A depth's error moves the point in frame 1 by its parallax, which is in proportion to the motion.
    const double share = std::sqrt(2.0) * T_B0B1.p.norm() / baseline_;
    plain_.sigma = sigma_ * std::sqrt(1.0 + share * share);
    std::array<StereoSums, 2> camera_sums;
    for (std::size_t k = 0; k < 2; ++k) plain_.frame1[k] = view_of(T_BC_[k], T_B0B1);
    fitting = kernels_.add_stereo(table_, plain_, camera_sums.data());
    NormalEquations sums;
    for (std::size_t k = 0; k < 2; ++k) {
      const Eigen::Matrix<double, 6, 6> J = camera_by_body(T_BC_[k], T_B0B1);
      const NormalEquations camera = equations_of(camera_sums[k]);
      const Eigen::Matrix<double, 6, 6> AJ = camera.A.lazyProduct(J);
      sums.A += J.transpose().lazyProduct(AJ);
      sums.b += J.transpose().lazyProduct(camera.b);
    }
    return sums;
  }

 private:
  /// A point of frame 0 with the ray x and the inverse depth s, both in the left camera, is at h = R x + s p in a
  /// camera of frame 1, times its inverse depth.
  [[nodiscard]] PlainPose view_of(const Pose& T_BC, const Pose& T_B0B1) const {
    const Eigen::Matrix3d R_CB0 = T_BC.R.transpose() * T_B0B1.R.transpose();
    const Pose& T_BC0 = T_BC_[0];
    return plain({R_CB0 * T_BC0.R, R_CB0 * (T_BC0.p - T_B0B1.p) - T_BC.R.transpose() * T_BC.p});
  }

  /// (theta, tau) in a camera by the turn of R_B0B1 and the shift of p_B0B1.
  static Eigen::Matrix<double, 6, 6> camera_by_body(const Pose& T_BC, const Pose& T_B0B1) {
    const Eigen::Matrix3d R_CB = T_BC.R.transpose();
    Eigen::Matrix<double, 6, 6> J = Eigen::Matrix<double, 6, 6>::Zero();
    J.topLeftCorner<3, 3>() = R_CB;
    J.bottomLeftCorner<3, 3>() = -R_CB * skew(T_BC.p);
    J.bottomRightCorner<3, 3>() = R_CB * T_B0B1.R.transpose();
    return J;
  }

  FilterKernels kernels_;
  StereoTable table_;
  StereoProblem plain_{};
  double sigma_;
  double baseline_;
  std::array<Pose, 2> T_BC_;
};

/// The excess of the turn (`begin` 0) or of the displacement (3), if the other one is as predicted to within
/// `covariance`.
Excess beyond(const StereoMotion& seen, const Pose& T_B0B1, int begin, const Eigen::Matrix3d& covariance) {
  const int other = 3 - begin;
  Eigen::Matrix<double, 6, 1> excess;
  excess << log_so3(T_B0B1.R.transpose() * seen.T_B0B1.R), seen.T_B0B1.p - T_B0B1.p;
  const Eigen::Matrix3d across = seen.covariance.block<3, 3>(begin, other);
  const Eigen::LDLT<Eigen::Matrix3d> ldlt(seen.covariance.block<3, 3>(other, other) + covariance);
  const Eigen::Matrix3d gain = ldlt.solve(across.transpose()).transpose();
  const Eigen::Vector3d explained = gain * excess.segment<3>(other);
  return {excess.segment<3>(begin) - explained, seen.covariance.block<3, 3>(begin, begin) - gain * across.transpose(),
          gain * covariance * gain.transpose(), explained};
}

}  // namespace

StereoMatches::StereoMatches() {
  earlier_.reserve(kFeatureCapacity);
  matches_.reserve(kFeatureCapacity);
}

const std::vector<StereoMatch>& StereoMatches::find(const FeatureFrame& from, const FeatureFrame& to,
                                                    const CameraState& cameras) {
  const auto& [left, right] = cameras.lens_error;
  const Pose T_C1C0 = cameras.T_C0C1.inverse();
  earlier_.clear();
  matches_.clear();
  for (const FeatureObservation& feature : from.features) {
    if (feature.has_right) earlier_.push_back(&feature);
  }
  const auto by_id = [](const FeatureObservation* f, const FeatureObservation* g) { return f->id < g->id; };
  std::sort(earlier_.begin(), earlier_.end(), by_id);
  for (const FeatureObservation& now : to.features) {
    const auto found = std::lower_bound(earlier_.begin(), earlier_.end(), &now, by_id);
    if (found == earlier_.end() || (*found)->id != now.id) continue;
    const FeatureObservation& before = **found;
    StereoMatch match{left.corrected(before.left), right.corrected(before.right), left.corrected(now.left),
                      right.corrected(now.right), now.has_right};
    const Eigen::Vector3d a = T_C1C0.R * match.left0.homogeneous();
    const Eigen::Vector3d h = a + inverse_depth(a, T_C1C0.p, match.right0) * T_C1C0.p;
    if (h.z() >= kLeastDepth) {
      const Eigen::Vector2d fitting = h.hnormalized();
      match.right1 -= match.right0 - fitting;
      match.right0 = fitting;
    }
    matches_.push_back(match);
  }
  return matches_;
}

double stereo_inverse_depth(const CameraState& cameras, const Eigen::Vector2d& left, const Eigen::Vector2d& right) {
  const Pose T_C1C0 = cameras.T_C0C1.inverse();
  return inverse_depth(T_C1C0.R * left.homogeneous(), T_C1C0.p, right);
}

double stereo_inverse_depth_sigma(const CameraState& cameras, double sigma) {
  return std::sqrt(2.0) * sigma / cameras.T_C0C1.p.norm();
}

std::optional<StereoMotion> stereo_motion(const std::vector<StereoMatch>& matches, const CameraState& cameras,
                                          const Pose& start, double sigma, double settled, Kernels kernels) {
  StereoMotion motion;
  motion.T_B0B1 = start;
  motion.matches = static_cast<int>(matches.size());
  if (motion.matches < kFewFeatures) return std::nullopt;
  Problem problem(matches, cameras, sigma, kernels);
  bool has_settled = false;
  for (int iteration = 0; iteration < kIterations; ++iteration) {
    const NormalEquations sums = problem.step(motion.T_B0B1, motion.fitting);
    const Eigen::LDLT<Eigen::Matrix<double, 6, 6>> ldlt(sums.A);
    const Eigen::Matrix<double, 6, 1> step = ldlt.solve(sums.b);
    if (ldlt.info() != Eigen::Success || !step.allFinite()) return std::nullopt;
    motion.T_B0B1.R = motion.T_B0B1.R * exp_so3(step.head<3>());
    motion.T_B0B1.p += step.tail<3>();
    motion.covariance = ldlt.solve(Eigen::Matrix<double, 6, 6>::Identity());
    const bool ends = step.norm() < settled;
    has_settled = ends || step.dot(sums.b) < kPrecise * kPrecise;  // in variances
    if (ends) break;
  }
  if (!has_settled) return std::nullopt;
  const bool together = motion.fitting >= kFewFeatures && motion.fitting >= kMajority * motion.matches;
  if (!together || !(motion.covariance.diagonal().minCoeff() > 0.0)) return std::nullopt;
  return motion;
}

Excess turn_beyond(const StereoMotion& seen, const Pose& T_B0B1, const Eigen::Matrix3d& p_covariance) {
  return beyond(seen, T_B0B1, 0, p_covariance);
}

Excess way_beyond(const StereoMotion& seen, const Pose& T_B0B1, double turn_variance) {
  return beyond(seen, T_B0B1, 3, turn_variance * Eigen::Matrix3d::Identity());
}

double apparent_variance(const Covariance& P, const Eigen::Vector3d& motion, const Eigen::Vector3d& change) {
  const auto variance = [&P](int entry) { return std::max(0.0, P.matrix()(entry, entry)); };
  const double mounting = P.matrix().diagonal().segment<3>(err::camera).cwiseMax(0.0).maxCoeff();
  return motion.squaredNorm() * (mounting + variance(err::lens(0))) + change.squaredNorm() * variance(err::time_offset);
}

double apparent_turn_variance(const Covariance& P, const Eigen::Vector3d& rate_B, const Eigen::Vector3d& change) {
  const double by_matrix = rate_B.squaredNorm() * std::max(0.0, P.matrix()(err::gyro_matrix, err::gyro_matrix));
  return apparent_variance(P, rate_B, change) + by_matrix;
}

bool follows(double dt, double duration) { return std::abs(dt - duration) < kPrecise * duration; }

}  // namespace ear
