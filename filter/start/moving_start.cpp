#include "filter/start/moving_start.h"

#include <algorithm>
#include <cmath>

#include "filter/ekf/propagation.h"
#include "filter/ekf/so3.h"
#include "filter/ingest/limits.h"
#include "filter/start/start_fit.h"

namespace ear {
namespace {

constexpr std::size_t kFewestFrames = 8;  // chosen: 24 rows for 9 unknowns, whatever the frames' rate
constexpr double kScaleSigma = 0.02;   // chosen: of a path; noise of the disparities makes points too near or too far
constexpr double kPathSigma = 1e-3;    // [m] chosen: the least of a path
constexpr double kAccelSigma = 0.3;    // [m/s^2] chosen: what a poor accelerometer may be off between two frames
constexpr double kWorstGravity = 0.7;  // [m/s^2] chosen: by which the cameras alone may miss it

using Fit = StartFit<9>;  // the gyroscope's bias is found before

/// What the inertial samples add up to since the first moment, in the body frame of then.
struct Sums {
  Eigen::Matrix3d R = Eigen::Matrix3d::Identity();
  Eigen::Vector3d velocity = Eigen::Vector3d::Zero();  // integral of R f
  Eigen::Vector3d position = Eigen::Vector3d::Zero();  // its integral
  Eigen::Matrix3d velocity_by_b_a = Eigen::Matrix3d::Zero();
  Eigen::Matrix3d position_by_b_a = Eigen::Matrix3d::Zero();

  void add(const Eigen::Vector3d& rate_B, const Eigen::Vector3d& accel_B, double dt) {
    const Eigen::Matrix3d middle = R * exp_so3(0.5 * dt * rate_B);
    const Eigen::Vector3d force = middle * accel_B;
    position += dt * velocity + 0.5 * dt * dt * force;
    velocity += dt * force;
    position_by_b_a += dt * velocity_by_b_a - 0.5 * dt * dt * middle;
    velocity_by_b_a -= dt * middle;
    R = R * exp_so3(dt * rate_B);
  }
};

/// The same image twice: no two exposures are exactly equal, and nothing shows how the vehicle moves.
bool frozen(const std::vector<StereoMatch>& matches) {
  return std::all_of(matches.begin(), matches.end(), [](const StereoMatch& m) { return m.left0 == m.left1; });
}

}  // namespace

void MovingStart::add(TimeNs t_ns, const FeatureFrame& frame, const ImuBuffer& imu, const CameraState& cameras) {
  const bool first = frames_.empty();
  if (first && (imu.empty() || imu[0].t_ns > t_ns)) return;
  TimedFrame next{t_ns, frame, StereoMotion{}};
  if (!first) {
    const TimedFrame& last = frames_.back();
    const std::vector<StereoMatch>& matches = matches_.find(last.features, frame, cameras);
    const Pose start = {gyro_rotation(last.t_ns, t_ns, Eigen::Vector3d::Zero(), imu),
                        path_to(t_ns).value_or(Eigen::Vector3d::Zero())};
    const double dt = seconds_between(last.t_ns, t_ns);
    const std::optional<StereoMotion> motion = stereo_motion(matches, cameras, start, feature_sigma_);
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
  if (frames_.size() < 2) return std::nullopt;
  const TimedFrame& last = frames_.back();
  const double share = seconds_between(last.t_ns, t_ns) / seconds_between(frames_[frames_.size() - 2].t_ns, last.t_ns);
  return Eigen::Vector3d(share * (last.motion.T_B0B1.R.transpose() * last.motion.T_B0B1.p));
}

/// What turns the gyroscope's rotation into that of the cameras.
Eigen::Vector3d MovingStart::gyro_bias(const ImuBuffer& imu) const {
  double weight = 1.0 / (prior_.gyro_bias * prior_.gyro_bias);
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  for (std::size_t k = 1; k < frames_.size(); ++k) {
    const double dt = seconds_between(frames_[k - 1].t_ns, frames_[k].t_ns);
    const Eigen::Matrix3d R = gyro_rotation(frames_[k - 1].t_ns, frames_[k].t_ns, Eigen::Vector3d::Zero(), imu);
    const double information = dt * dt / (kSeenTurn * kSeenTurn);
    sum -= information / dt * log_so3(R.transpose() * frames_[k].motion.T_B0B1.R);
    weight += information;
  }
  return sum / weight;
}

bool MovingStart::spans_enough(std::size_t first) const {
  return frames_.size() >= first + kFewestFrames &&
         seconds_between(frames_[first].t_ns, frames_.back().t_ns) >= kStartSpan;
}

std::optional<ImuState> MovingStart::solve(const ImuBuffer& imu) const {
  if (!spans_enough()) return std::nullopt;
  const Eigen::Vector3d b_g = gyro_bias(imu);
  const TimeNs start_ns = frames_.front().t_ns;
  Fit fit;
  fit.expect(Fit::accel_bias, prior_.accel_bias);
  Sums sums;
  for (std::size_t k = 1; k < frames_.size(); ++k) {
    const TimeNs from_ns = frames_[k - 1].t_ns;
    const TimeNs to_ns = frames_[k].t_ns;
    const Sums before = sums;
    imu.for_each_piece(from_ns, to_ns, [&](const Eigen::Vector3d& gyro_B, const Eigen::Vector3d& accel_B, double dt) {
      sums.add(gyro_B - b_g, accel_B, dt);
    });
    const double t0 = seconds_between(start_ns, from_ns);
    const double t1 = seconds_between(start_ns, to_ns);
    const StereoMotion& motion = frames_[k].motion;
    Fit::Rows H;
    H.middleCols<3>(Fit::velocity) = (t1 - t0) * Eigen::Matrix3d::Identity();
    H.middleCols<3>(Fit::gravity) = 0.5 * (t1 * t1 - t0 * t0) * Eigen::Matrix3d::Identity();
    H.middleCols<3>(Fit::accel_bias) = sums.position_by_b_a - before.position_by_b_a;
    const Eigen::Vector3d z = before.R * motion.T_B0B1.p - (sums.position - before.position);
    const double scale = kScaleSigma * motion.T_B0B1.p.norm();
    const double unsteady = kAccelSigma * (t1 - t0) * (t1 - t0);
    const double variance =
        motion.p_covariance().trace() / 3.0 + kPathSigma * kPathSigma + scale * scale + unsteady * unsteady;
    fit.add(H, z, variance);
  }

  // Gravity as the cameras alone see it must have about its known size.
  if (!(std::abs(fit.free_gravity() + kGravity_W.z()) < kWorstGravity)) return std::nullopt;
  const std::optional<Fit::Vector> x = fit.solve();
  if (!x) return std::nullopt;
  return start_state(start_ns, x->segment<3>(Fit::velocity), x->segment<3>(Fit::gravity), b_g,
                     x->segment<3>(Fit::accel_bias));
}

}  // namespace ear
