#include "filter/sources/cameras/cameras.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "filter/ekf/initial_state.h"
#include "filter/ekf/relative_motion.h"
#include "filter/ingest/limits.h"

namespace ear {
namespace {

constexpr double kBridgePosition = 5e-3;  // [m] chosen, as kSeenTurn: well above what the features will show later
constexpr double kComparedStep = 1e-4;    // [rad, m] chosen: a tenth of what two images show

/// Of the turn since the newest clone, all axes together [rad^2].
double turn_variance_since_clone(const Ekf& ekf) {
  const auto P = ekf.covariance().matrix();
  const int clone = err::clone(static_cast<int>(ekf.state().clones.size()) - 1);
  return P.diagonal().segment<3>(err::theta).sum() + P.diagonal().segment<3>(clone).sum() -
         2.0 * P.block<3, 3>(err::theta, clone).trace();
}

/// The body now, in the body as it was.
Pose motion_since(const Pose& T_WB0, const ImuState& now) {
  return {T_WB0.R.transpose() * now.R_WB, T_WB0.R.transpose() * (now.p_WB - T_WB0.p)};
}

}  // namespace

Cameras::Cameras(const FilterConfig& config, const Calibration& calibration)
    : config_(config),
      count_(calibration.cameras.size()),
      focal_px_(focal_length(calibration)),
      tracks_(2 * kFeatureCapacity, static_cast<std::size_t>(config.window) + 1),
      views_(count_ == 1 ? static_cast<std::size_t>(config.window) + 1 : 0),
      track_update_(config, focal_px_),
      window_(config, focal_px_),
      frame_check_(config.feature_sigma_px, focal_px_),
      rows_(6, err::clone(config.window + 1)),
      iterated_(config.window) {
  last_features_.features.reserve(kFeatureCapacity);
  compared_.before.features.reserve(kFeatureCapacity);
}

void Cameras::measure_noise(const FeatureFrame& frame, const CameraState& cameras) {
  compared_.matched_ns.reset();
  compared_.seen.reset();
  if (count_ > 1) frame_check_.measure_noise(frame, cameras);
}

Displacement Cameras::displacement(const FeatureFrame& frame, TimeNs t_ns, const ImuMotion& motion, const Ekf& ekf) {
  Displacement result;
  const State& x = ekf.state();
  if (x.imu.t_ns == compared_.t_ns) {  // else the frame before was not where the state is
    if (count_ > 1) {
      const std::vector<StereoMatch>& matches = matches_.find(compared_.before, frame, x.camera);
      compared_.matched_ns = compared_.before.t_ns;
      compared_.seen =
          stereo_motion(matches, x.camera, motion.T_BiBj, frame_check_.sigma(), kComparedStep, config_.kernels);
      result.contradictory = !compared_.seen && matches.size() >= kFewFeatures;
    } else if (!x.clones.empty() && x.clones.back().t_ns == x.imu.t_ns) {
      compared_.seen = motion_by_one(frame, motion.T_BiBj, ekf);
    }
    result.available = compared_.seen.has_value();
    if (compared_.seen) result.p_BiBj = compared_.seen->T_B0B1.p;
    if (compared_.seen) result.covariance = compared_.seen->p_covariance();
  }
  compared_.t_ns = t_ns;
  compared_.before = frame;
  return result;
}

std::optional<Pose> Cameras::image_pose(const State& x) const {
  if (!last_) return std::nullopt;
  if (!last_->clone) return last_->T_WB;
  const auto clone =
      std::find_if(x.clones.begin(), x.clones.end(), [this](const Clone& c) { return c.frame == *last_->clone; });
  if (clone == x.clones.end()) return last_->T_WB;  // it was marginalised
  return clone->T_WB * last_->in_clone;
}

const std::vector<StereoMatch>& Cameras::matches_with(const FeatureFrame& frame, const CameraState& cameras) {
  if (compared_.matched_ns == last_->t_ns) return matches_.found();
  compared_.matched_ns = last_->t_ns;
  compared_.seen.reset();
  return matches_.find(last_features_, frame, cameras);
}

/// All lengths that it shows are as uncertain as the way between both views.
std::optional<StereoMotion> Cameras::motion_by_one(const FeatureFrame& frame, const Pose& start, const Ekf& ekf) {
  if (!views_.find(ekf.state(), ekf.covariance(), start.p.norm())) return std::nullopt;
  const CameraState& both = views_.cameras();
  std::optional<StereoMotion> motion = stereo_motion(matches_.find(views_.features(), frame, both), both, start,
                                                     frame_check_.sigma(), kComparedStep, config_.kernels);
  if (!motion) return motion;
  const Eigen::Vector3d& p = motion->T_B0B1.p;
  motion->covariance.bottomRightCorner<3, 3>() += views_.scale_variance() * p * p.transpose();
  return motion;
}

/// Images that are too unlike to show it have few features in common, by which a state that is far off would learn to
/// be elsewhere.
bool Cameras::bridge(const FeatureFrame& frame, Ekf& ekf) {
  const State& x = ekf.state();
  const std::optional<Pose> before = image_pose(x);
  if (!before || count_ == 0 || x.clones.empty()) return false;
  const std::optional<StereoMotion> motion =
      count_ == 1
          ? motion_by_one(frame, motion_since(x.clones.back().T_WB, x.imu), ekf)
          : stereo_motion(matches_with(frame, x.camera), x.camera, motion_since(*before, x.imu), frame_check_.sigma());
  if (motion) {
    apply_bridge(*motion, ekf);
  } else if (count_ > 1) {
    while (!x.clones.empty()) ekf.marginalise(0);
    tracks_.clear();
  }
  return motion.has_value();
}

/// The features that show the motion count again: here they count a sixteenth, and still bring the state to where it is
/// linear. The square of the turn that is not known then moves them all alike, where noise averages out: if it is more
/// than that, they count at once.
void Cameras::apply_bridge(const StereoMotion& motion, Ekf& ekf) {
  const State& x = ekf.state();
  const Eigen::Matrix3d R_WB0 = x.clones.back().T_WB.R;
  Eigen::Matrix<double, 6, 6> to_world = Eigen::Matrix<double, 6, 6>::Zero();  // the fit's turn is in the later body
  to_world.topLeftCorner<3, 3>() = R_WB0 * motion.T_B0B1.R;
  to_world.bottomRightCorner<3, 3>() = R_WB0;
  Eigen::Matrix<double, 6, 6> covariance = kClear * kClear * to_world * motion.covariance * to_world.transpose();
  covariance.diagonal().head<3>().array() += kSeenTurn * kSeenTurn;
  covariance.diagonal().tail<3>().array() += kBridgePosition * kBridgePosition;
  const Eigen::LLT<Eigen::Matrix<double, 6, 6>> llt(covariance);
  auto H = rows_.topLeftCorner(6, x.error_size());
  Eigen::Matrix<double, 6, 1> r;
  const auto linearize = [&](const State& at) {
    linearize_relative_motion(at, motion.T_B0B1, H, r);
    llt.matrixL().solveInPlace(H);
    llt.matrixL().solveInPlace(r);
  };
  linearize(x);
  iterated_.run(
      x, [&] { return ekf.correction(H, 0, r, CameraUpdate::considered); },
      [&](const State& found, const auto& moved) {
        linearize(found);
        r.noalias() += H.lazyProduct(moved);
        return true;
      });
  ekf.apply(H, 0, r, CameraUpdate::considered);
  const double left_out = 0.5 * turn_variance_since_clone(ekf);
  gap_is_wide_ = left_out * std::sqrt(motion.matches) > frame_check_.sigma();
}

FrameAgreement Cameras::compare(const FeatureFrame& frame, const Ekf& ekf) {
  FrameAgreement agreement;
  compared_.agrees = true;
  if (count_ < 2) return agreement;
  const State& x = ekf.state();
  const std::optional<Pose> before = image_pose(x);
  const double dt = before ? seconds_between(last_->t_ns, frame.t_ns) : 0.0;
  if (before && dt <= kStale) {
    const double sigma_v = std::sqrt(ekf.covariance().matrix().diagonal().segment<3>(err::nu).maxCoeff());
    agreement = frame_check_.compare(matches_with(frame, x.camera), motion_since(*before, x.imu), dt * sigma_v,
                                     x.camera, ekf.gate());
    compared_.agrees = !agreement.contradicts();
  }
  agreement.noise = frame_check_.noise();
  agreement.behind = frame_check_.share_behind(frame, x.camera);
  return agreement;
}

void Cameras::update(const FeatureFrame& frame, double weight, CameraUpdate calibration, Ekf& ekf, Records& records) {
  ekf.clone(frame_check_.noise(), weight);
  tracks_.add(ekf.state().clones.back().frame, frame.features);
  if (count_ == 1) views_.add(ekf.state().clones.back().frame, frame.features);
  const std::optional<std::size_t> next = window_.to_marginalise(ekf.state(), tracks_);
  const UsedTracks ordinary = next && *next == 0 ? UsedTracks::oldest_too : UsedTracks::ended;
  const UsedTracks use = std::exchange(gap_is_wide_, false) ? UsedTracks::all : ordinary;
  track_update_.update(use, calibration, tracks_, ekf, records);
  window_.add_updates(records.statistics.features_used, ekf.state().imu.t_ns);
  marginalise(next, ekf);
  while (ekf.state().clones.size() > window_.size()) marginalise(0, ekf);  // the window has become smaller
}

void Cameras::clone_without_image(double weight, Ekf& ekf) {
  ekf.clone(frame_check_.noise(), weight);
  marginalise(window_.to_marginalise(ekf.state(), tracks_), ekf);
}

void Cameras::marginalise(std::optional<std::size_t> clone, Ekf& ekf) {
  if (!clone) return;
  if (*clone == 0) window_.set_updated(ekf.state().imu.t_ns);  // by all that reached back to it
  tracks_.forget_frame(ekf.state().clones[*clone].frame);
  views_.forget(ekf.state().clones[*clone].frame);
  ekf.marginalise(*clone);
}

void Cameras::remember(const FeatureFrame& frame, const Ekf& ekf) {
  const State& x = ekf.state();
  last_ = LastImage{frame.t_ns, std::nullopt, std::nullopt, {}};
  last_features_ = frame;
  if (!ekf.running()) return;
  last_->T_WB = x.imu.T_WB();
  if (x.clones.empty()) return;
  const Clone& clone = x.clones.back();
  const Eigen::Matrix3d R_BW = clone.T_WB.R.transpose();
  last_->clone = clone.frame;
  last_->in_clone = {R_BW * x.imu.R_WB, R_BW * (x.imu.p_WB - clone.T_WB.p)};
}

bool Cameras::show_motion(const State& x) const {
  return last_ && compared_.agrees && last_features_.features.size() >= kFewFeatures &&
         seconds_between(imu_time(last_->t_ns, x.camera), x.imu.t_ns) < kStreamGap;
}

void Cameras::reset() {
  tracks_.clear();
  views_.clear();
  track_update_.reset();
  window_.reset();
  compared_.t_ns = 0;
  gap_is_wide_ = false;
  if (!last_) return;
  last_->T_WB.reset();
  last_->clone.reset();
}

}  // namespace ear
