// Smoother: what the sensors tell of the way from one frame to the next, the images left aside.
#include <algorithm>
#include <cmath>

#include "filter/ekf/propagation.h"
#include "filter/sources/wheels/wheel_agreement.h"
#include "filter/sources/wheels/wheel_displacement.h"
#include "smoother/smoother.h"

namespace ear::smoother {
namespace {

constexpr double kWheelAge = 0.1;              // [s] older readings do not tell whether the wheels rest
constexpr double kRefused = 1.0;               // [m] standard deviation of a direction that wheels tell nothing of
constexpr TimeNs kMissedReading = 50'000'000;  // [ns] without wheel readings: an interval has a gap
constexpr TimeNs kRateOver = 10'000'000;       // [ns] over which the rate at a frame is averaged

}  // namespace

/// As in the filter: before anything of the interval up to t_ns is used.
void Smoother::compare_sensors(const FeatureFrame& frame, const ImuState& x, TimeNs t_ns) {
  State state;
  state.imu = x;
  state.odometer = window_->odometer();
  const Eigen::Vector3d n_B = normal_.known() ? normal_.n_B() : Eigen::Vector3d(state.odometer.T_BO.R.col(2));
  state.ground.n_W = x.R_WB * n_B;
  tell_covariance(x);

  const ImuMotion motion = imu_motion(x, imu_, t_ns, calibration_.imu);
  displacements_ = Displacements{};
  displacements_[index_of(MotionSensor::imu)] = imu_displacement(motion, P_);
  if (encoder_ && rolls_at(x.t_ns) && normal_.known()) {
    const WheelSetting setting{wheel_model(state.odometer),
                               wheel_noise(config_.odometer, *calibration_.encoder, calibration_.imu),
                               config_.odometer.speed_sigma, config_.odometer.side_slip_turn, true};
    displacements_[index_of(MotionSensor::odometer)] =
        wheel_displacement(state, P_, WheelIncrements(passed_turn_, turns_), imu_, t_ns, setting);
  }
  const double bias = motion.duration * motion.duration * P_.matrix().diagonal().segment<3>(err::b_g).maxCoeff();
  displacements_[index_of(MotionSensor::camera)] =
      camera_displacement_.add(frame, window_->cameras(), motion.R_BiBj, motion.rotation_variance + bias);
  consistency_ = consistency_check_(displacements_);
}

/// The newest covariance in the filter's errors: nu = dv + [v]x theta, rho = dp + [p]x theta.
void Smoother::tell_covariance(const ImuState& x) {
  ImuErrorMatrix T = ImuErrorMatrix::Identity();
  T.block<3, 3>(err::nu, err::theta) = skew(x.v_W);
  T.block<3, 3>(err::rho, err::theta) = skew(x.p_WB);
  P_.reset(Eigen::VectorXd::Zero(err::clones));
  P_.inflate(err::theta, T * covariance_->state * T.transpose());
  P_.inflate(err::normal, normal_.covariance());
  P_.inflate(err::wheel_radius, covariance_->wheels);
}

double Smoother::trust(MotionSensor sensor) const {
  if (!config_.anomaly.enabled || consistency_.anomalous != sensor) return 1.0;
  return std::max(consistency_.weight[index_of(sensor)], config_.anomaly.min_weight);
}

/// What all but the images tell of the way to the frame.
NewFrame Smoother::moved_to(const FeatureFrame& frame, const ImuState& x, TimeNs t_ns) {
  const StandstillConfig& rest = config_.standstill;
  const bool still =
      standstill_.update(frame, imu_.statistics(t_ns - static_cast<TimeNs>(1e9 * rest.duration), t_ns), b_g_,
                         rest.max_gyro, on_ground() ? wheel_rest_.duration(t_ns, kWheelAge) : std::nullopt);
  statistics_.standing = still;
  NewFrame next;
  next.t_ns = t_ns;
  next.since.imu = preintegrate(x, t_ns);
  next.since.wheels = roll(x, t_ns);
  next.since.still = still && was_still_;
  next.rate_B = imu_.mean_rate(t_ns - kRateOver, t_ns).gyro_B - b_g_;
  next.feature_noise = 1.0 / trust(MotionSensor::camera);
  was_still_ = still;
  return next;
}

ImuPreintegration Smoother::preintegrate(const ImuState& x, TimeNs t_ns) {
  ImuPreintegration result(x.b_g, x.b_a);
  imu_.for_each_piece(
      x.t_ns, t_ns,
      [&](const Eigen::Vector3d& gyro_B, const Eigen::Vector3d& accel_B, double dt, const ImuNoiseFactors& factors) {
        ImuCalibration noise = calibration_.imu;
        noise.gyro_noise *= factors.gyro;
        noise.accel_noise *= factors.accel / trust(MotionSensor::imu);
        result.add(gyro_B, accel_B, dt, noise);
      });
  return result;
}

/// What the wheels tell of the interval, with its noise; nothing where they tell nothing.
std::optional<WheelDisplacement> Smoother::roll(const ImuState& x, TimeNs t_ns) {
  if (!encoder_) return std::nullopt;
  if (!rolls_at(x.t_ns)) {
    ranges_.clear();
    normal_ns_ = t_ns;
    return std::nullopt;
  }
  std::optional<WheelDisplacement> z = integrate_wheels(x, t_ns);
  statistics_.beams_used = normal_.beams_used();
  statistics_.beams_rejected = normal_.beams_rejected();
  if (!z || !z->usable || !add_wheel_noise(*z, t_ns)) return std::nullopt;
  return z;
}

/// (9): turn by turn, along the ground as the lasers last saw it.
std::optional<WheelDisplacement> Smoother::integrate_wheels(const ImuState& x, TimeNs t_ns) {
  take_ranges(x.t_ns);
  const OdometerState odometer = window_->odometer();
  WheelPreintegration wheels(wheel_model(odometer),
                             wheel_noise(config_.odometer, *calibration_.encoder, calibration_.imu));
  bool started = false;
  const WheelIncrements turns(passed_turn_, turns_);
  TimeNs now_ns = x.t_ns;
  for (std::size_t i = 0; i < turns.size() && now_ns < t_ns; ++i) {
    const WheelIncrement& turn = turns[i];
    const bool last = i + 1 == turns.size();
    if (turn.to_ns <= now_ns && !last) continue;
    if (turn.from_ns > now_ns + kMissedReading || (last && t_ns > turn.to_ns + kMissedReading)) return std::nullopt;
    const TimeNs end_ns = last ? t_ns : std::min(t_ns, turn.to_ns);
    const double dt = seconds_between(now_ns, end_ns);
    speed_ = odometer.wheel_radius.mean() * turn.angle.mean() / turn.duration();
    const bool seen = take_ranges(now_ns + (end_ns - now_ns) / 2);
    if (!normal_.known()) return std::nullopt;
    if (seen || !started) {
      const Eigen::Vector3d n_Bk = gyro_rotation(now_ns, normal_ns_) * normal_.n_B();
      if (!started) wheels.start(n_Bk, x.b_g);
      wheels.set_normal(n_Bk, normal_.reading_sigma());
      started = true;
    }
    const MeanRate rate = imu_.mean_rate(now_ns, end_ns);
    wheels.add_interval(rate.gyro_B, dt, turn.angle * (dt / turn.duration()), rate.noise_factor);
    now_ns = end_ns;
  }
  if (now_ns < t_ns) return std::nullopt;
  take_ranges(t_ns);
  move_normal(t_ns);
  return wheels.result();
}

/// What is not in the pre-integration; and each direction in which the wheels do not agree with the inertial samples
/// tells nothing. False if none is left.
bool Smoother::add_wheel_noise(WheelDisplacement& z, TimeNs t_ns) {
  const Eigen::Vector3d y_B = window_->odometer().T_BO.R.col(1);
  const OdometerConfig& odometer = config_.odometer;
  auto covariance = z.covariance.topLeftCorner<3, 3>();
  covariance.diagonal().array() += std::pow(odometer.speed_sigma * z.duration, 2);
  covariance += std::pow(odometer.side_slip_turn * log_so3(z.R_BiBj).norm(), 2) * y_B * y_B.transpose();
  covariance /= std::pow(trust(MotionSensor::odometer), 2);

  const Displacement& wheels = displacements_[index_of(MotionSensor::odometer)];
  const Displacement& inertial = displacements_[index_of(MotionSensor::imu)];
  if (!wheels.available || !inertial.available) return false;
  const Eigen::Vector3d n_B = normal_.n_B();
  const Eigen::Vector3d ahead_B = y_B.cross(n_B).normalized();
  const std::array<Eigen::Vector3d, 3> directions = {ahead_B, y_B, n_B};
  int left = 0;
  for (std::size_t i = 0; i < directions.size(); ++i) {
    const Eigen::Vector3d& u = directions[i];
    const double d = u.dot(inertial.p_BiBj - wheels.p_BiBj);
    const double variance = u.dot((inertial.covariance + wheels.covariance) * u);
    if (agrees_again(agrees_since_ns_[i], gate_.fits(d, variance), t_ns)) {
      ++left;
    } else {
      covariance += kRefused * kRefused * u * u.transpose();
    }
  }
  statistics_.wheel_rows_used += left;
  statistics_.wheel_rows_rejected += 3 - left;
  return left > 0;
}

/// Takes in the ranges up to `until_ns`. Were there any that told something?
bool Smoother::take_ranges(TimeNs until_ns) {
  const OdometerState odometer = window_->odometer();
  bool any = false;
  while (!ranges_.empty() && ranges_.front().t_ns <= until_ns) {
    move_normal(ranges_.front().t_ns);
    any = normal_.add(ranges_.front().range, odometer) || any;
    ranges_.pop();
  }
  return any;
}

void Smoother::move_normal(TimeNs t_ns) {
  if (normal_.known() && t_ns > normal_ns_) {
    normal_.move(gyro_rotation(normal_ns_, t_ns), speed_ * seconds_between(normal_ns_, t_ns));
  }
  normal_ns_ = normal_.known() ? std::max(normal_ns_, t_ns) : t_ns;
}

/// R_B0B1 from one time to another, either way round.
Eigen::Matrix3d Smoother::gyro_rotation(TimeNs from_ns, TimeNs to_ns) const {
  if (to_ns < from_ns) return gyro_rotation(to_ns, from_ns).transpose();
  Eigen::Matrix3d R = Eigen::Matrix3d::Identity();
  imu_.for_each_piece(from_ns, to_ns, [&](const Eigen::Vector3d& gyro_B, const Eigen::Vector3d&, double dt) {
    R *= exp_so3((gyro_B - b_g_) * dt);
  });
  return R;
}

void Smoother::forget_passed(TimeNs t_ns) {
  while (!turns_.empty() && turns_.front().to_ns <= t_ns) {
    passed_turn_ = turns_.front();
    turns_.pop();
  }
}

}  // namespace ear::smoother
