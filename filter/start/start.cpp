#include "filter/start/start.h"

#include <cmath>

#include "filter/ekf/initial_state.h"
#include "filter/start/rolling_start.h"

namespace ear {
namespace {

constexpr double kRollingStart = 1.5;        // [s] chosen: of increments that a rolling start takes
constexpr double kMovingVelocity = 0.5;      // [m/s] and share of the speed: before the samples of the window are used
constexpr double kGravityTolerance = 1.5;    // [m/s^2] chosen: of the specific force at rest; more is a wrong unit
constexpr double kStartGravityNoise = 0.02;  // [m/s^2] what idling rotors leave in the mean specific force
constexpr double kLeastStartSpeed = 0.2;     // [m/s] chosen: a first start in motion; slower is as good as standing
constexpr double kKnownSigma = 1e-6;         // [m, rad] of position and yaw at the start: by definition zero
constexpr double kUnknownTilt = 0.3;         // [rad] before gravity was measured

}  // namespace

Start::Start(const FilterConfig& config, const Calibration& calibration)
    : config_(config),
      calibration_(calibration),
      moving_({config.prior.gyro_bias, config.prior.accel_bias, config.feature_sigma_px / focal_length(calibration)}) {}

bool Start::uses_wheels() const { return calibration_.encoder && config_.odometer.model != OdometerModel::none; }

bool Start::scale_is_given() const {
  const bool lasers = calibration_.lasers && !calibration_.lasers->beams.empty();
  return uses_wheels() && config_.online_calibration.wheels && !lasers && calibration_.cameras.empty();
}

std::optional<StartState> Start::find(const Situation& now, const ImuStatistics& recent, const Ingest& ingest) {
  std::optional<StartState> start;
  if (now.stands && recent.count >= 2) start = standing(now.t_ns, recent);
  if (!start && now.rolls) {
    const RollingStartNoise noise{config_.prior.gyro_bias, config_.prior.accel_bias};
    const OdometerState odometer = odometer_state(calibration_);
    const auto x = rolling_start(ingest.imu(), ingest.waiting_increments(), odometer, noise, kRollingStart);
    if (x) start = in_motion(*x);
  }
  if (start) return start;
  start = find_in_motion(now, ingest, true);
  // A first start can wait for the vehicle to stand, which shows gravity and biases better, or to move.
  const bool waits = start && !now.restarts && start->x.v_W.norm() < kLeastStartSpeed;
  return waits ? std::nullopt : start;
}

std::optional<StartState> Start::find_in_motion(const Situation& now, const Ingest& ingest, bool contradicted) {
  if (calibration_.cameras.size() < 2 || now.frame.features.empty()) return std::nullopt;
  moving_.add(now.t_ns, now.frame, ingest.imu(), now.cameras);
  const std::optional<ImuState> x = contradicted ? moving_.solve(ingest.imu()) : std::nullopt;
  if (!x) return std::nullopt;
  StartState start = in_motion(*x);
  start.from_frames = true;
  return start;
}

MapAlignment Start::begin(const StartState& start, const std::optional<Estimate>& last_good, const Advice& advice,
                          Ingest& ingest, Ekf& ekf, Sources& sources, Records& records) {
  ekf.start(start.x, start.sigma, scale_is_given());
  if (start.residual.size() > 0) {
    ingest.drop_readings();  // of the time when it stood
    ekf.apply(start.H, 0, start.residual, CameraUpdate::considered);
  }
  MapAlignment alignment;
  if (last_good) {
    alignment = align_after_restart(*last_good, ekf.state().imu, ingest.imu(), calibration_.imu.gyro_noise);
  }
  if (start.from_frames) {
    ingest.drop_before(start.x.t_ns);
    const FrameStatistics statistics = records.statistics;
    for (std::size_t i = 0; i + 1 < moving_.frames().size(); ++i) {
      const MovingStart::TimedFrame& frame = moving_.frames()[i];
      sources.advance(frame.t_ns, advice, ingest, ekf, records);
      sources.use_image(frame.features, false, advice, ekf, records);
    }
    records.statistics = statistics;
  }
  forget_frames();
  return alignment;
}

std::optional<StartState> Start::standing(TimeNs t_ns, const ImuStatistics& imu) const {
  if (std::abs(imu.accel_mean.norm() - kGravity_W.norm()) > kGravityTolerance) return std::nullopt;
  StartState start;
  ImuState& x = start.x;
  x.t_ns = t_ns;
  x.R_WB = Eigen::Quaterniond::FromTwoVectors(imu.accel_mean, Eigen::Vector3d::UnitZ()).toRotationMatrix();
  x.b_g = imu.gyro_mean;
  start.sigma = sigma();
  // What the force measures beyond gravity's known size can only be bias.
  const Eigen::Vector3d gravity_B = -(x.R_WB.transpose() * kGravity_W);

  // force = R^T (-g) + b_a + n, rate = b_g + n; with the invariant error, R^T u = R^^T (u + [u]x theta).
  const double root_duration = std::sqrt(imu.duration);
  const double accel_sigma = std::hypot(calibration_.imu.accel_noise / root_duration, kStartGravityNoise);
  const double gyro_sigma = calibration_.imu.gyro_noise / root_duration;
  start.H.setZero(6, err::imu_size);
  start.residual.resize(6);
  start.H.block<3, 3>(0, err::theta) = x.R_WB.transpose() * skew(-kGravity_W) / accel_sigma;
  start.H.block<3, 3>(0, err::b_a) = Eigen::Matrix3d::Identity() / accel_sigma;
  start.residual.head<3>() = (imu.accel_mean - gravity_B - x.b_a) / accel_sigma;
  start.H.block<3, 3>(3, err::b_g) = Eigen::Matrix3d::Identity() / gyro_sigma;
  start.residual.tail<3>() = (imu.gyro_mean - x.b_g) / gyro_sigma;
  return start;
}

/// `x` is where the linearisation starts, not an estimate: the velocity is as good as unknown.
StartState Start::in_motion(const ImuState& x) const {
  StartState start;
  start.x = x;
  start.sigma = sigma();
  start.sigma.segment<3>(err::nu).setConstant(kMovingVelocity * (1.0 + x.v_W.norm()));
  start.H.resize(0, err::imu_size);
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
      sigma.segment<3>(err::stereo + 3).setConstant(prior.stereo_position);
    }
  }
  if (online.time_offset && !calibration_.cameras.empty()) sigma(err::time_offset) = prior.time_offset;
  if (uses_wheels()) {
    const auto beams = calibration_.lasers ? static_cast<Eigen::Index>(calibration_.lasers->beams.size()) : 0;
    sigma.segment<2>(err::normal).setConstant(config_.odometer.normal_prior);
    if (online.wheels) sigma.segment<2>(err::wheel_radius).setConstant(prior.wheel_radius);
    if (online.wheels) sigma(err::track_width) = prior.track_width;
    if (online.odometer_rotation) {
      sigma.segment<3>(err::odometer).setConstant(beams > 0 ? prior.odometer_rotation : prior.odometer_unseen);
    }
    if (online.axle) sigma.segment<3>(err::axle).setConstant(beams > 0 ? prior.axle : prior.axle_unseen);
    if (online.beam_offset) sigma.segment(err::beams, beams).setConstant(prior.beam_offset);
  }
  return sigma;
}

}  // namespace ear
