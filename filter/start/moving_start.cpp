#include "filter/start/moving_start.h"

#include <algorithm>
#include <cmath>

#include "filter/ekf/initial_state.h"
#include "filter/ekf/propagation.h"
#include "filter/ekf/so3.h"
#include "filter/ingest/limits.h"
#include "filter/start/start_fit.h"
#include "filter/start/start_sums.h"

namespace ear {
namespace {

constexpr std::size_t kFewestFrames = 8;  // chosen: 42 rows for 12 unknowns, whatever the frames' rate
constexpr double kScaleSigma = 0.02;  // chosen: of a path; noise of the disparities makes points too near or too far

/// The same image twice: no two exposures are exactly equal, and nothing shows how the vehicle moves.
bool frozen(const std::vector<StereoMatch>& matches) {
  return std::all_of(matches.begin(), matches.end(), [](const StereoMatch& m) { return m.left0 == m.left1; });
}

}  // namespace

MovingStart::MovingStart(const FilterConfig& config, const Calibration& calibration)
    : noise_{config.prior, calibration.imu, config.feature_sigma_px / focal_length(calibration)},
      stereo_(calibration.cameras.size() == 2) {}

void MovingStart::add(TimeNs t_ns, const FeatureFrame& frame, const ImuBuffer& imu, const CameraState& cameras) {
  const bool first = frames_.empty();
  if (first && (imu.empty() || imu[0].t_ns > t_ns)) return;
  TimedFrame next{t_ns, frame, StereoMotion{}};
  if (!first && !stereo_) {
    if (frame.repeated || seconds_between(frames_.back().t_ns, t_ns) >= kStale) frames_.clear();
  } else if (!first) {
    const TimedFrame& last = frames_.back();
    const std::vector<StereoMatch>& matches = matches_.find(last.features, frame, cameras);
    const Pose start = {gyro_rotation(last.t_ns, t_ns, Eigen::Vector3d::Zero(), imu),
                        path_to(t_ns).value_or(Eigen::Vector3d::Zero())};
    const double dt = seconds_between(last.t_ns, t_ns);
    const std::optional<StereoMotion> motion = stereo_motion(matches, cameras, start, noise_.feature_sigma);
    if (motion && dt < kStale && !frozen(matches)) {
      next.motion = *motion;
    } else {
      frames_.clear();
    }
  }
  frames_.push_back(std::move(next));
  while (spans_enough(1)) frames_.erase(frames_.begin());
}

std::optional<Eigen::Vector3d> MovingStart::path_to(TimeNs t_ns) const {
  if (!stereo_ || frames_.size() < 2) return std::nullopt;
  const TimedFrame& last = frames_.back();
  const double share = seconds_between(last.t_ns, t_ns) / seconds_between(frames_[frames_.size() - 2].t_ns, last.t_ns);
  return Eigen::Vector3d(share * (last.motion.T_B0B1.R.transpose() * last.motion.T_B0B1.p));
}

bool MovingStart::spans_enough(std::size_t first) const {
  return frames_.size() >= first + kFewestFrames &&
         seconds_between(frames_[first].t_ns, frames_.back().t_ns) >= kStartSpan;
}

StartAttempt MovingStart::solve(const ImuBuffer& imu, const CameraState& cameras) {
  if (!spans_enough()) return {std::nullopt, Reason::few_frames};
  if (stereo_) return by_two_cameras(imu);
  const TimeNs now_ns = frames_.back().t_ns;
  if (tried_ns_ && now_ns > *tried_ns_ && seconds_between(*tried_ns_, now_ns) < kStartSpan / kFewestFrames) {
    return {std::nullopt, lacked_};
  }
  tried_ns_ = now_ns;
  std::vector<SeenFrame> seen;
  for (const TimedFrame& frame : frames_) seen.push_back({frame.t_ns, &frame.features});
  StartAttempt attempt = single_camera_start(seen, imu, cameras, noise_);
  lacked_ = attempt.lacks;
  return attempt;
}

/// The gyroscope's bias turns what the samples add up to: linear in it where it is known roughly, from a first fit.
StartAttempt MovingStart::by_two_cameras(const ImuBuffer& imu) const {
  const StartFit rough = fit_to_motions(Eigen::Vector3d::Zero(), imu);
  const StartFit fit = fit_to_motions(rough.solution().segment<3>(StartFit::gyro_bias), imu);
  const std::optional<StartFit::Vector> x = fit.solve();
  if (!x || !fit.expected(*x, kClear)) return {std::nullopt, Reason::cameras_contradict};
  return {start_state(frames_.front().t_ns, *x), Reason::none};
}

StartFit MovingStart::fit_to_motions(const Eigen::Vector3d& b_g, const ImuBuffer& imu) const {
  StartFit fit(noise_.prior);
  StartSums sums;
  for (std::size_t k = 1; k < frames_.size(); ++k) {
    const TimeNs from_ns = frames_[k - 1].t_ns;
    const TimeNs to_ns = frames_[k].t_ns;
    const StartSums before = sums;
    imu.for_each_piece(from_ns, to_ns, [&](const Eigen::Vector3d& gyro_B, const Eigen::Vector3d& accel_B, double dt) {
      sums.add(gyro_B - b_g, accel_B, dt);
    });
    const double t0 = seconds_between(frames_.front().t_ns, from_ns);
    const double t1 = seconds_between(frames_.front().t_ns, to_ns);
    const StereoMotion& motion = frames_[k].motion;
    const Eigen::Vector3d path = before.R * motion.T_B0B1.p;
    StartFit::Rows H = StartFit::Rows::Zero();
    H.middleCols<3>(StartFit::velocity) = (t1 - t0) * Eigen::Matrix3d::Identity();
    H.middleCols<3>(StartFit::gravity) = 0.5 * (t1 * t1 - t0 * t0) * Eigen::Matrix3d::Identity();
    H.middleCols<3>(StartFit::gyro_bias) = skew(path) * before.R_by_b_g + sums.position_by_b_g - before.position_by_b_g;
    H.middleCols<3>(StartFit::accel_bias) = sums.position_by_b_a - before.position_by_b_a;
    const Eigen::Vector3d z = path - (sums.position - before.position) + H.middleCols<3>(StartFit::gyro_bias) * b_g;
    const double scale = kScaleSigma * path.norm();
    fit.add(H, z, motion.p_covariance().trace() / 3.0 + scale * scale);

    const Eigen::Matrix3d R = before.R.transpose() * sums.R;
    StartFit::Rows H_turn = StartFit::Rows::Zero();
    H_turn.middleCols<3>(StartFit::gyro_bias) = -(t1 - t0) * Eigen::Matrix3d::Identity();
    fit.add(H_turn, log_so3(R.transpose() * motion.T_B0B1.R) - (t1 - t0) * b_g, kSeenTurn * kSeenTurn);
  }
  return fit;
}

}  // namespace ear
