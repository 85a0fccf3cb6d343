// Filter: starting while the vehicle stands, rolls or moves; stopping, and starting again where it was.
#include "filter/filter.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "filter/initial_state.h"
#include "filter/rolling_start.h"

namespace ear {
namespace {

constexpr double kRollingStart = 1.5;        // [s] of them that it takes
constexpr double kRollingVelocity = 0.5;     // [m/s] and share of the speed: before the samples of the window are used
constexpr double kGravityTolerance = 1.5;    // [m/s^2] of the specific force at rest: more is a wrong unit
constexpr double kStartGravityNoise = 0.02;  // [m/s^2] what idling rotors leave in the mean specific force
constexpr double kKnownSigma = 1e-6;         // [m, rad] of position and yaw at the start: by definition zero
constexpr double kKnownScale = 1e-6;         // of the wheels where nothing can tell it
constexpr double kUnknownTilt = 0.3;         // [rad] before gravity was measured
constexpr double kLeastStartSpeed = 0.2;     // [m/s] slower is as good as standing
constexpr double kUnseenSpeed = 1.0;         // [m/s] that the vehicle may have gained since it was lost

}  // namespace

/// As after construction, but for the inertial clock, and where the vehicle was last known to be.
void Filter::restart(TimeNs t_ns, TimeNs clock_shift) {
  Filter fresh(config_, calibration_);
  fresh.clocks_ = std::move(clocks_);
  fresh.guard_ = std::move(guard_);
  fresh.guard_.restart();
  fresh.monitor_.succeed(monitor_, t_ns);
  fresh.anchor_ = anchor_;
  fresh.last_good_ = std::move(last_good_);
  if (fresh.last_good_) fresh.last_good_->state.t_ns += clock_shift;
  if (status_ == Status::tracking || status_ == Status::lost) fresh.status_ = Status::lost;
  *this = std::move(fresh);
}

/// While lost, the state goes on, and is good again if the cameras come to agree with it. Where they do not, but agree
/// with the inertial samples, it is the state that is wrong, and begins anew.
void Filter::start_again(const FeatureFrame& frame) {
  if (!monitor_.lost()) {
    moving_start_.clear();
    return;
  }
  if (frame.features.empty() || calibration_.cameras.size() < 2) return;
  const CameraState given = camera_state(calibration_);  // what was learned may be as wrong as the rest
  const auto offset_ns = static_cast<TimeNs>(std::llround(1e9 * given.time_offset));
  moving_start_.add(frame.t_ns + offset_ns, frame, imu_, given);
  if (!monitor_.contradicted() || !moving_start_.solve(imu_)) return;
  stop();
  if (begin_moving()) advance_measuring(imu_time(frame.t_ns));
}

/// Nothing of the state is used any more.
void Filter::stop() {
  status_ = Status::lost;
  state_.imu = ImuState{};
  state_.clones.clear();
  state_.camera = camera_state(calibration_);
  state_.odometer = odometer_state(calibration_);
  state_.ground = GroundState{};
  tracks_.clear();
  turns_.clear();
  ranges_.clear();
  displacement_.reset();
  displacement_turns_.clear();
  bias_watch_.clear();
  imu_gap_.reset();
  doubtful_since_ns_.reset();
  bridged_ns_.reset();
  agrees_since_ns_.fill(0);
  ground_known_ = false;
  clone_is_here_ = false;
  camera_displacement_.clear();
}

/// Standing: the mean specific force is gravity, the mean rate is the gyroscope's bias.
bool Filter::try_start(TimeNs t_ns, const ImuStatistics& imu, bool still) {
  if (status_ != Status::lost) status_ = imu.count < 2 ? Status::waiting_for_imu : Status::waiting_for_standstill;
  if (!still || imu.count < 2) return false;
  if (std::abs(imu.accel_mean.norm() - kGravity_W.norm()) > kGravityTolerance) return false;

  ImuState& x = state_.imu;
  x = ImuState{};
  x.t_ns = t_ns;
  x.R_WB = Eigen::Quaterniond::FromTwoVectors(imu.accel_mean, Eigen::Vector3d::UnitZ()).toRotationMatrix();
  x.b_g = imu.gyro_mean;
  // What the force measures beyond gravity's known size can only be bias.
  const Eigen::Vector3d gravity_B = -(x.R_WB.transpose() * kGravity_W);

  reset_covariance(start_sigma());
  status_ = Status::tracking;
  turns_.clear();  // all before t_ns
  ranges_.clear();

  // force = R^T (-g) + b_a + n, rate = b_g + n; with the invariant error, R^T u = R^^T (u + [u]x theta).
  const double root_duration = std::sqrt(imu.duration);
  const double accel_sigma = std::hypot(calibration_.imu.accel_noise / root_duration, kStartGravityNoise);
  const double gyro_sigma = calibration_.imu.gyro_noise / root_duration;
  Eigen::Matrix<double, 6, err::imu_size> H = Eigen::Matrix<double, 6, err::imu_size>::Zero();
  Eigen::Matrix<double, 6, 1> r;
  H.block<3, 3>(0, err::theta) = x.R_WB.transpose() * skew(-kGravity_W) / accel_sigma;
  H.block<3, 3>(0, err::b_a) = Eigen::Matrix3d::Identity() / accel_sigma;
  r.head<3>() = (imu.accel_mean - gravity_B - x.b_a) / accel_sigma;
  H.block<3, 3>(3, err::b_g) = Eigen::Matrix3d::Identity() / gyro_sigma;
  r.tail<3>() = (imu.gyro_mean - x.b_g) / gyro_sigma;
  update(H, 0, r);
  join_worlds();
  return true;
}

/// Rolling: begin where the window of samples begins, near what explains them, and take them in from there.
bool Filter::try_rolling_start() {
  if (!on_ground()) return false;
  const RollingStartNoise noise{config_.prior.gyro_bias, config_.prior.accel_bias};
  const std::optional<ImuState> start = rolling_start(imu_, turns_, state_.odometer, noise, kRollingStart);
  if (!start) return false;
  state_.imu = *start;
  Eigen::VectorXd sigma = start_sigma();
  sigma.segment<3>(err::nu).setConstant(kRollingVelocity * (1.0 + start->v_W.norm()));
  reset_covariance(sigma);
  status_ = Status::tracking;
  join_worlds();
  return true;
}

/// Moving, with two cameras.
bool Filter::try_moving_start(const FeatureFrame& frame) {
  if (calibration_.cameras.size() < 2 || frame.features.empty()) return false;
  moving_start_.add(imu_time(frame.t_ns), frame, imu_, state_.camera);
  return begin_moving();
}

/// Begin where the window of frames begins, near what explains them, and take them in from there; all but the last,
/// which is the frame at hand.
bool Filter::begin_moving() {
  const std::optional<ImuState> start = moving_start_.solve(imu_);
  if (!start) return false;
  // A first start can wait for the vehicle to stand, which tells gravity and biases better, or to move.
  if (status_ != Status::lost && start->v_W.norm() < kLeastStartSpeed) return false;
  state_.imu = *start;
  Eigen::VectorXd sigma = start_sigma();
  sigma.segment<3>(err::nu).setConstant(kRollingVelocity * (1.0 + start->v_W.norm()));
  covariance_.reset(sigma);
  status_ = Status::tracking;
  while (!turns_.empty() && turns_.front().from_ns < start->t_ns) turns_.pop();
  while (!ranges_.empty() && ranges_.front().t_ns < start->t_ns) ranges_.pop();
  join_worlds();
  const FrameStatistics statistics = statistics_;
  const std::vector<MovingStart::TimedFrame>& frames = moving_start_.frames();
  for (std::size_t i = 0; i + 1 < frames.size(); ++i) {
    advance_measuring(frames[i].t_ns);
    use_image(frames[i].features, false);
  }
  statistics_ = statistics;
  moving_start_.clear();
  return true;
}

/// After a start that is not the first: the vehicle is where it was last known to be, less and less certainly; the
/// gyroscope tells how it turned since.
void Filter::join_worlds() {
  if (!last_good_) return;
  NavState last = last_good_->state;
  const auto variance = last_good_->covariance.diagonal().cwiseMax(0.0);
  const TimeNs from_ns = std::min(last.t_ns, state_.imu.t_ns);
  const TimeNs to_ns = std::max(last.t_ns, state_.imu.t_ns);
  const double since = seconds_between(from_ns, to_ns);
  double yaw_variance = variance(estimate_error::rotation + 2);
  if (imu_[0].t_ns <= from_ns) {
    Eigen::Matrix3d turned = Eigen::Matrix3d::Identity();
    imu_.for_each_piece(from_ns, to_ns, [&](const Eigen::Vector3d& gyro_B, const Eigen::Vector3d&, double dt) {
      turned *= exp_so3((gyro_B - last.b_g) * dt);
    });
    last.q_WB =
        last.q_WB * Eigen::Quaterniond(last.t_ns <= state_.imu.t_ns ? turned : Eigen::Matrix3d(turned.transpose()));
    yaw_variance += since * since * variance.segment<3>(estimate_error::gyro_bias).maxCoeff() +
                    since * calibration_.imu.gyro_noise * calibration_.imu.gyro_noise;
  } else {
    yaw_variance = M_PI * M_PI / 3.0;
  }
  const double way = since * (last.v_W.norm() + kUnseenSpeed);
  const double position_sigma = std::sqrt(variance.segment<3>(estimate_error::position).maxCoeff() + way * way);
  anchor_ = Anchor::join(last, predict_here(state_.imu.t_ns), std::sqrt(yaw_variance), position_sigma);
}

/// The accelerometer could tell the scale of the wheels, if its gain were known better than theirs. It is not: only
/// their difference is learned, and ordinary_covariance counts what the scale may be off.
void Filter::reset_covariance(const Eigen::VectorXd& sigma) {
  covariance_.reset(sigma);
  if (!scale_is_given()) return;
  const Eigen::RowVector2d mean_is_known(0.5 / kKnownScale, 0.5 / kKnownScale);
  covariance_.update(mean_is_known, err::wheel_radius, Eigen::Matrix<double, 1, 1>::Zero());
}

/// Standard deviations of the whole error vector before gravity and biases were measured.
Eigen::VectorXd Filter::start_sigma() const {
  const OnlineCalibrationConfig& online = config_.online_calibration;
  const PriorConfig& prior = config_.prior;
  Eigen::VectorXd sigma = Eigen::VectorXd::Zero(err::clones);
  sigma.segment<3>(err::theta) << kUnknownTilt, kUnknownTilt, kKnownSigma;
  sigma.segment<3>(err::nu).setConstant(config_.standstill.velocity_sigma);
  sigma.segment<3>(err::rho).setConstant(kKnownSigma);
  sigma.segment<3>(err::b_g).setConstant(prior.gyro_bias);
  sigma.segment<3>(err::b_a).setConstant(prior.accel_bias);
  if (online.camera_extrinsics && !calibration_.cameras.empty()) {
    sigma.segment<3>(err::camera).setConstant(prior.camera_rotation);
    sigma.segment<3>(err::camera + 3).setConstant(prior.camera_position);
    if (calibration_.cameras.size() == 2) {
      sigma.segment<3>(err::stereo).setConstant(prior.stereo_rotation);
      sigma.segment<3>(err::stereo + 3).setConstant(prior.stereo_position);
    }
  }
  if (online.time_offset && !calibration_.cameras.empty()) sigma(err::time_offset) = prior.time_offset;
  if (encoder_) {
    sigma.segment<2>(err::normal).setConstant(config_.odometer.normal_prior);
    if (online.wheels) sigma.segment<2>(err::wheel_radius).setConstant(prior.wheel_radius);
    if (online.wheels) sigma(err::track_width) = prior.track_width;
    if (online.odometer_rotation) {
      sigma.segment<3>(err::odometer).setConstant(sees_ground() ? prior.odometer_rotation : prior.odometer_unseen);
    }
    if (online.beam_tilt) sigma.segment(err::beams, beam_count_).setConstant(prior.beam_tilt);
  }
  return sigma;
}

}  // namespace ear
