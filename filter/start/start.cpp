#include "filter/start/start.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <string>

#include "filter/ekf/initial_state.h"
#include "filter/ingest/limits.h"
#include "filter/start/rolling_start.h"
#include "filter/start/start_fit.h"

namespace ear {
namespace {

constexpr double kMovingVelocity = 0.5;    // [m/s] chosen: and share of the speed, before the window is used
constexpr double kGravityTolerance = 1.5;  // [m/s^2] chosen: of the specific force at rest; more is a wrong unit
constexpr double kUnknownTilt = 0.3;       // [rad] chosen: before gravity was measured
constexpr double kUnitTolerance = 1e-3;    // chosen: of the length of a quaternion: digits that were cut off

/// Where the force `force_B` is felt, errors E of the accelerometer's matrix measure as the bias -E force.
Eigen::Matrix<double, 3, 9> bias_by_matrix(const Eigen::Vector3d& force_B) {
  Eigen::Matrix<double, 3, 9> J;
  for (int axis = 0; axis < 3; ++axis) J.middleCols<3>(3 * axis) = -force_B(axis) * Eigen::Matrix3d::Identity();
  return J;
}

}  // namespace

GivenStart checked(const GivenStart& given) {
  const auto require = [](bool condition, const char* what) {
    if (!condition) throw std::invalid_argument(std::string("start: ") + what);
  };
  const auto require_sigma = [&](double sigma, bool zero_too, const char* what) {
    require(std::isfinite(sigma) && (sigma > 0.0 || (zero_too && sigma == 0.0)), what);
  };
  GivenStart start = given;
  NavState& x = start.state;
  require(is_time(x.t_ns), "t_ns: farther from zero than 142 years");
  require(x.p_WB.allFinite(), "p_WB: not finite");
  require(std::abs(x.q_WB.norm() - 1.0) < kUnitTolerance, "q_WB: a quaternion of length one is needed");
  require(x.v_W.allFinite(), "v_W: not finite");
  require(x.b_g.allFinite(), "b_g: not finite");
  require(x.b_a.allFinite(), "b_a: not finite");
  require_sigma(start.tilt_sigma, false, "tilt_sigma: must be positive");
  require_sigma(start.yaw_sigma, true, "yaw_sigma: must not be negative");
  require_sigma(start.position_sigma, true, "position_sigma: must not be negative");
  require_sigma(start.velocity_sigma, false, "velocity_sigma: must be positive");
  require_sigma(start.gyro_bias_sigma.value_or(1.0), false, "gyro_bias_sigma: must be positive");
  require_sigma(start.accel_bias_sigma.value_or(1.0), false, "accel_bias_sigma: must be positive");
  x.q_WB.normalize();
  return start;
}

Start::Start(const FilterConfig& config, const Calibration& calibration)
    : config_(config), calibration_(calibration), moving_(config, calibration) {}

bool Start::scale_is_given() const {
  return uses_wheels(config_, calibration_) && config_.online_calibration.wheels && !has_beams(calibration_) &&
         calibration_.cameras.empty();
}

std::optional<StartState> Start::find(const Situation& now, const Ingest& ingest) {
  if (given_) return as_given(now.t_ns, ingest.imu());
  if (now.lost) return moving(now, ingest.imu());
  std::optional<StartState> start;
  Reason lacks = now.recent.count < 2 ? Reason::few_samples : Reason::moves_unseen;
  if (now.stands && now.recent.count >= 2) {
    start = standing(now.t_ns, now.recent);
    lacks = Reason::other_gravity;
  }
  if (!start && now.rolls) {
    const Ring<WheelIncrement>& turns = ingest.waiting_increments();
    lacks = lacking_for_rolling_start(ingest.imu(), turns, now.t_ns, kStartSpan);
    if (lacks == Reason::none) {
      const StartAttempt attempt =
          rolling_start(ingest.imu(), turns, odometer_state(calibration_), start_sigma(config_.prior, calibration_),
                        calibration_.encoder->stamp_sigma, now.wheel_noise);
      lacks = attempt.lacks;
      if (attempt.x) start = in_motion(attempt);
    }
  }
  if (start) return start;
  start = moving(now, ingest.imu());
  if (calibration_.cameras.empty() || lacks == Reason::other_gravity || now.rolls) waits_for_ = lacks;
  return start;
}

std::optional<StartState> Start::moving(const Situation& now, const ImuBuffer& imu) {
  waits_for_ = calibration_.cameras.empty() ? Reason::moves_unseen : Reason::few_frames;
  if (calibration_.cameras.empty() || now.frame.features.empty()) return std::nullopt;
  moving_.add(now.t_ns, now.frame, imu);
  if (now.lost && !now.contradicted) return std::nullopt;
  const StartAttempt attempt = moving_.solve(imu, camera_state(calibration_));
  waits_for_ = attempt.lacks;
  if (!attempt.x) return std::nullopt;
  StartState start = in_motion(attempt);
  start.from_frames = true;
  return start;
}

MapAlignment Start::begin(const StartState& start, const std::optional<Estimate>& last_good, const Advice& advice,
                          Ingest& ingest, Ekf& ekf, Sources& sources, Records& records) {
  ekf.start(start.x, start.sigma, scale_is_given());
  if (start.residual.size() > 0) ekf.apply(start.H, 0, start.residual, CameraUpdate::considered);
  MapAlignment alignment;
  if (start.alignment) {
    ingest.drop_before(start.x.t_ns);
    alignment = *start.alignment;
    given_.reset();
  } else {
    if (start.residual.size() > 0 && !start.from_frames) ingest.drop_readings();  // of the time when it stood
    if (last_good) {
      alignment = align_after_restart(*last_good, ekf.state().imu, ingest.imu(), calibration_.imu.gyro_noise);
    }
  }
  if (start.from_frames) {
    if (start.imu_noise) sources.imu_score().set_start(*start.imu_noise);
    ingest.drop_before(start.x.t_ns);
    const FrameStatistics statistics = records.statistics;
    for (std::size_t i = 0; i + 1 < moving_.frames().size(); ++i) {
      const TimedFrame& frame = moving_.frames()[i];
      sources.advance(frame.t_ns, advice, ingest, ekf, records);
      sources.update(&frame.features, false, advice, ekf, records);
    }
    records.statistics = statistics;
    if (!last_good) ekf.move_origin();
  }
  forget_frames();
  return alignment;
}

/// In a world of its own, whose origin is where the vehicle was: far from it rotation and position have nothing to do
/// with each other. The velocity is given in the world, not in the body, whose attitude is uncertain:
/// dv = nu - [v]x theta.
std::optional<StartState> Start::as_given(TimeNs t_ns, const ImuBuffer& imu) {
  const NavState& given = given_->state;
  waits_for_ = t_ns < given.t_ns ? Reason::start_is_ahead : Reason::start_is_past;
  if (t_ns < given.t_ns || imu.empty() || imu[0].t_ns > given.t_ns) return std::nullopt;
  StartState start;
  start.x = {given.t_ns, given.q_WB.toRotationMatrix(), given.v_W, Eigen::Vector3d::Zero(), given.b_g, given.b_a};
  start.sigma = sigma();
  const double yaw = std::max(given_->yaw_sigma, kKnownSigma);
  start.sigma.segment<3>(err::theta) << given_->tilt_sigma, given_->tilt_sigma, yaw;
  start.sigma.segment<3>(err::nu).setConstant(kFastest);  // it is measured below
  if (given_->gyro_bias_sigma) start.sigma.segment<3>(err::b_g).setConstant(*given_->gyro_bias_sigma);
  if (given_->accel_bias_sigma) start.sigma.segment<3>(err::b_a).setConstant(*given_->accel_bias_sigma);
  start.H.setZero(3, err::camera);
  start.H.middleCols<3>(err::theta) = -skew(given.v_W) / given_->velocity_sigma;
  start.H.middleCols<3>(err::nu) = Eigen::Matrix3d::Identity() / given_->velocity_sigma;
  start.residual.setZero(3);
  start.alignment.emplace();
  start.alignment->p_WA = given.p_WB;
  start.alignment->position_sigma = given_->position_sigma;
  return start;
}

std::optional<StartState> Start::standing(TimeNs t_ns, const ImuStatistics& imu) const {
  if (std::abs(imu.accel_mean.norm() - kGravity_W.norm()) > kGravityTolerance) return std::nullopt;
  StartState start;
  ImuState& x = start.x;
  x.t_ns = t_ns;
  x.R_WB = turn_between(imu.accel_mean, Eigen::Vector3d::UnitZ());
  x.b_g = imu.gyro_mean;
  start.sigma = sigma();
  // What the force measures beyond gravity's known size can only be bias.
  const Eigen::Vector3d gravity_B = x.rest_force_B();

  // force = (I - E) R^T (-g) + b_a + n, rate = b_g + n; with the invariant error, R^T u = R^^T (u + [u]x theta).
  const double root_duration = std::sqrt(imu.duration);
  const auto as_shown = [](double stated, double shown) { return shown > kClear * stated ? shown : stated; };
  const double accel_sigma =
      as_shown(std::hypot(calibration_.imu.accel_noise / root_duration, kShakenAccel), imu.accel_error);
  const double gyro_sigma = as_shown(calibration_.imu.gyro_noise / root_duration, imu.gyro_error);
  start.H.setZero(6, err::camera);
  start.residual.setZero(6);  // that of the rate stays
  start.H.block<3, 3>(0, err::theta) = x.R_WB.transpose() * skew(-kGravity_W) / accel_sigma;
  start.H.block<3, 3>(0, err::b_a) = Eigen::Matrix3d::Identity() / accel_sigma;
  start.H.block<3, 9>(0, err::accel_matrix) = bias_by_matrix(gravity_B) / accel_sigma;
  start.residual.head<3>() = (imu.accel_mean - gravity_B) / accel_sigma;
  start.H.block<3, 3>(3, err::b_g) = Eigen::Matrix3d::Identity() / gyro_sigma;
  return start;
}

/// The samples of the fit are used again: it only says where the filter is to be linear, so the velocity is as good as
/// unknown. By images the filter would then learn the length of the path from its own errors of linearisation: the fit
/// says what it is, with kWorstFit times its standard deviations. dv_B = R^T nu, dg_B = R^T [g]x theta.
StartState Start::in_motion(const StartAttempt& attempt) const {
  StartState start;
  start.x = *attempt.x;
  start.sigma = sigma();
  start.sigma.segment<3>(err::nu).setConstant(kMovingVelocity * (1.0 + start.x.v_W.norm()));
  if (!attempt.information) return start;
  const Eigen::Matrix3d R_BW = start.x.R_WB.transpose();
  Eigen::Matrix<double, StartFit::motion_size, err::camera> J;
  J.setZero();
  J.block<3, 3>(StartFit::velocity, err::nu) = R_BW;
  J.block<3, 3>(StartFit::gravity, err::theta) = R_BW * skew(kGravity_W);
  J.block<3, 3>(StartFit::gyro_bias, err::b_g).setIdentity();
  J.block<3, 3>(StartFit::accel_bias, err::b_a).setIdentity();
  J.block<3, 9>(StartFit::accel_bias, err::accel_matrix) = bias_by_matrix(start.x.rest_force_B());
  start.H = attempt.information->llt().matrixU() * J / kWorstFit;
  start.residual.setZero(StartFit::motion_size);
  start.imu_noise = attempt.imu_noise;
  return start;
}

/// Standard deviations of the whole error vector before gravity and biases were measured.
Eigen::VectorXd Start::sigma() const {
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
      // The baseline scales with the size of the target that the cameras were calibrated with: large rigs are known to
      // a share of it. Where it is stated, that is in it.
      const double share = calibration_.cameras[1].pose_sigma ? 0.0 : prior.focal_length;
      const Eigen::Array3d by_target = share * camera_state(calibration_).T_C0C1.p;
      sigma.segment<3>(err::stereo + 3) = (by_target.square() + prior.stereo_position * prior.stereo_position).sqrt();
    }
  }
  const bool unseen = calibration_.cameras.empty();
  Eigen::Matrix3d gyro = Eigen::Matrix3d::Constant(unseen ? prior.gyro_axes_unseen : prior.gyro_scale);
  if (unseen) gyro.diagonal().setConstant(prior.gyro_unseen);
  sigma.segment<9>(err::gyro_matrix) = gyro.reshaped();
  sigma.segment<9>(err::accel_matrix).setConstant(prior.accel_scale);
  for (std::size_t i = 0; online.intrinsics && i < calibration_.cameras.size(); ++i) {
    sigma.segment<err::lens_size>(err::lens(static_cast<int>(i))) = lens_sigma(prior, calibration_.cameras[i]);
  }
  if (online.time_offset && !calibration_.cameras.empty()) sigma(err::time_offset) = prior.time_offset;
  if (uses_wheels(config_, calibration_)) {
    const auto beams = calibration_.lasers ? static_cast<Eigen::Index>(calibration_.lasers->beams.size()) : 0;
    sigma.segment<2>(err::normal).setConstant(config_.odometer.normal_prior);
    if (online.wheels) sigma.segment<2>(err::wheel_radius).setConstant(prior.wheel_radius);
    if (online.wheels) sigma(err::track_width) = prior.track_width;
    if (online.odometer_rotation) {
      sigma.segment<3>(err::odometer).setConstant(odometer_rotation_sigma(prior, calibration_));
    }
    if (online.axle) sigma.segment<3>(err::axle).setConstant(beams > 0 ? prior.axle : prior.axle_unseen);
    if (online.encoder_time_offset) sigma(err::encoder_offset) = prior.encoder_time_offset;
    if (online.beam_offset) sigma.segment(err::beams, beams).setConstant(prior.beam_offset);
  }
  return sigma;
}

}  // namespace ear
