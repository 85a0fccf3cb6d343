#include "filter/sources/wheels/wheels.h"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <initializer_list>
#include <utility>

#include "filter/ekf/propagation.h"
#include "filter/ingest/limits.h"

namespace ear {
namespace {

constexpr double kSlipLasts = 0.1;  // [s] measured, docs/decisions/0039: a slip is the same for so long

/// How many readings like this one share an error that lasts so long [s].
double readings_that_share(double lasting, const WheelIncrement& increment) {
  return std::max(1.0, lasting / increment.duration());
}

}  // namespace

Wheels::Wheels(const OdometerConfig& config, const Calibration& calibration, bool sees_ground)
    : config_(config),
      encoder_(*calibration.encoder),
      imu_(calibration.imu),
      sees_ground_(sees_ground),
      mounting_(config, *calibration.encoder) {}

void Wheels::watch(const WheelIncrement& stamped) {
  const Eigen::Vector2d rims(encoder_.wheel_radius[0] * stamped.angle(0), encoder_.wheel_radius[1] * stamped.angle(1));
  path_noise_.add(rims.mean() / stamped.duration(), stamped);
  turn_noise_.add((rims(1) - rims(0)) / (encoder_.track_width * stamped.duration()), stamped);
}

void Wheels::update(const WheelIncrement& stamped, const Context& context, Ekf& ekf, Records& records) {
  const State& x = ekf.state();
  const WheelIncrement increment = later_by(x.odometer.time_offset, stamped);
  const BodyMotion motion = motion_at(middle_of(increment), x.imu, context.imu);
  mounting_.add(stamped, context.imu, x.imu.b_g, motion.R_WB.transpose() * Eigen::Vector3d::UnitZ());
  MeanRate rate = context.imu.mean_rate(increment.from_ns, increment.to_ns);
  rate.noise_factor *= context.gyro_noise;
  const auto rows_at = [&](const Eigen::Vector3d& v_W, const Eigen::Vector3d& gyro_B) {
    return linearize_wheels(x, motion.R_WB, v_W, increment, gyro_B, config_.model, sees_ground_);
  };
  WheelRows rows = rows_at(motion.v_W, rate.gyro_B);
  // Wheels that rest show where they point by nothing but noise, and by what shakes the body on its springs.
  if (context.wheels_rest) rows.H = rows_at(Eigen::Vector3d::Zero(), x.imu.b_g).H;
  show_time_offset(rows, stamped, ekf);
  const Noise noise =
      noise_of(rows, increment, rate, x, encoder_.rate_hz > 0.0 ? 1.0 / encoder_.rate_hz : increment.duration());
  count_readings(rows, stamped, noise.reading, ekf);
  Sigmas sigma = noise.rows;
  add_left_out(sigma, motion.R_WB, increment, ekf);
  add_delay(sigma, increment, ekf);
  score_wheels(rows, sigma, increment, context, ekf, records);

  const bool use_yaw_rate = config_.model != OdometerModel::gyro;
  const std::array<bool, WheelRows::size> use = {true, true, !uses_plane() || context.ground_known, use_yaw_rate};
  static_assert(WheelRows::size <= GroundRows::size);
  GroundRows z;
  for (int row = 0; row < WheelRows::size; ++row) {
    if (!use[static_cast<std::size_t>(row)]) continue;
    if (row != WheelRows::speed) {
      const Innovation innovation = gate_test(ekf, rows.H.row(row), rows.residual(row), sigma(row));
      if (row == WheelRows::slope && !innovation.fits) running_.lifted_ns = increment.to_ns;
      NoiseScore& score = running_.row[static_cast<std::size_t>(row)];
      const double usual = sigma(row);
      sigma(row) *= std::sqrt(score.add(innovation, usual, config_.scores, increment.to_ns));
      if (row == WheelRows::side && !context.stands) {
        const double variance = innovation.variance + sigma(row) * sigma(row) - usual * usual;
        sideways_.add(innovation.value, variance, increment.to_ns);
      }
      count(score, records.statistics);
    }
    z.H.row(z.count) = rows.H.row(row);
    z.residual(z.count) = rows.residual(row);
    z.sigma(z.count++) = sigma(row);
  }
  ekf.apply(z, context.weight, context.calibration);
}

void Wheels::count(const NoiseScore& score, FrameStatistics& statistics) {
  ++(score.fits() ? statistics.wheel_rows_used : statistics.wheel_rows_rejected);
}

/// What slips or bumps is white in the distance; the readings and the gyroscope add their own. Readings are as noisy as
/// stated, or as they show if that is clearly more. What they show, and what stamps are off by, the next reading takes
/// back: of the path it is in the state. What is stated of counts is white: they may be sums of speeds.
Wheels::Noise Wheels::noise_of(const WheelRows& rows, const WheelIncrement& increment, const MeanRate& rate,
                               const State& x, double usual_dt) const {
  const double dt = increment.duration();
  const double per_root_metre = std::sqrt(std::abs(rows.wheel_speed) / dt);
  const double yaw_rate = x.imu.rate_B(rate.gyro_B).norm();
  const double gyro_noise = rate.noise_factor * imu_.gyro_noise / std::sqrt(dt);
  const double count_noise = std::sqrt(2.0) * encoder_.noise_counts * 2.0 * M_PI /
                             static_cast<double>(encoder_.resolution) / dt * x.odometer.wheel_radius.mean() /
                             std::sqrt(2.0);
  // Of a speed, relative. An interval that seems short makes a speed that is too high: weights in proportion to the
  // interval leave the mean as it is.
  const double per_interval = 1.0 / std::sqrt(usual_dt * dt);
  const double stamp_noise = encoder_.stamp_sigma * std::sqrt(2.0) * per_interval;
  // On springs and tyres the body does not point along its path, and no laser shows by how much. Readings that are late
  // or repeat do not show how fast it goes, nor does a state that does not know yet.
  const double goes = std::max(std::abs(rows.wheel_speed), std::abs(rows.predicted_speed()));
  const double sway = sees_ground_ ? 0.0 : goes / std::sqrt(dt);  // [m/s] per [rad sqrt(s)]
  const double stated_turn = std::hypot(count_noise * 2.0 / x.odometer.track_width, stamp_noise * yaw_rate);
  const double shown_turn = turn_noise_.of_increment() * per_interval;
  const double turn_noise = shown_turn > kNoisy * stated_turn ? shown_turn : stated_turn;
  const double stated_path = std::hypot(count_noise, stamp_noise * rows.wheel_speed);
  const double shown_path = path_noise_.of_increment();
  const bool noisy = shown_path * per_interval > kNoisy * stated_path;
  Noise noise;
  noise.reading = noisy ? shown_path / std::sqrt(2.0) : encoder_.stamp_sigma * std::abs(rows.predicted_rim_speed());
  const auto root_sum = [&](int row, std::initializer_list<double> sigmas) {
    double variance = 0.0;
    for (const double s : sigmas) variance += s * s;
    const double gyro = gyro_noise * rows.J_gyro.row(row).norm();
    return std::sqrt(variance + gyro * gyro);
  };
  const double floor = config_.speed_sigma;
  const double slip = config_.slip * per_root_metre;
  noise.rows << root_sum(WheelRows::speed, {floor, slip, noisy ? 0.0 : count_noise}),
      root_sum(WheelRows::side,
               {floor, config_.side_slip * per_root_metre, config_.side_slip_turn * yaw_rate, config_.body_yaw * sway}),
      root_sum(WheelRows::slope, {floor, config_.roughness * per_root_metre, config_.body_pitch * sway}),
      root_sum(WheelRows::yaw_rate, {config_.yaw_rate_sigma, turn_noise});
  return noise;
}

/// What a reading is off by, `sigma`, the next one takes back: the errors of the last two are in the state.
void Wheels::count_readings(WheelRows& rows, const WheelIncrement& stamped, double sigma, Ekf& ekf) {
  const int before = std::exchange(running_.reading, 1 - running_.reading);
  if (stamped.from_ns != running_.read_ns) ekf.restart_reading(before, sigma);
  ekf.restart_reading(running_.reading, sigma);
  running_.read_ns = stamped.to_ns;
  rows.count_readings(ekf.state().odometer, running_.reading, stamped.duration());
}

/// A reading of another moment shows the speed then. A yaw rate that changes is left out.
void Wheels::show_time_offset(WheelRows& rows, const WheelIncrement& stamped, const Ekf& ekf) {
  const Eigen::Matrix<double, 1, kGroundColumns> h = rows.H.row(WheelRows::speed);
  const double sigma = std::sqrt(ekf.covariance().variance(h, err::nu));
  rows.H(WheelRows::speed, ground_column(err::encoder_offset)) =
      running_.speed_change.add(rows.predicted_rim_speed(), sigma, stamped);
}

/// No white noise: what the first order leaves out is the same for readings of a moment.
void Wheels::add_left_out(Sigmas& sigma, const Eigen::Matrix3d& R_WB, const WheelIncrement& increment,
                          const Ekf& ekf) const {
  if (sees_ground_) return;
  const auto P = ekf.covariance().matrix();
  const double variance =
      speed_left_out(R_WB * ekf.state().odometer.T_BO.R, P.block<3, 3>(err::odometer, err::odometer),
                     P.block<3, 3>(err::odometer, err::nu), P.block<3, 3>(err::nu, err::nu));
  const double readings = readings_that_share(kStreamGap, increment);
  sigma(WheelRows::speed) = std::hypot(sigma(WheelRows::speed), std::sqrt(readings * variance));
}

/// A reading that the state has passed is compared with the velocity then, taken back by the inertial samples.
void Wheels::add_delay(Sigmas& sigma, const WheelIncrement& increment, const Ekf& ekf) {
  const double tilt = std::sqrt(ekf.covariance().matrix().diagonal().segment<2>(err::theta).maxCoeff());
  const double late = taken_back_sigma(tilt, seconds_between(increment.to_ns, ekf.state().imu.t_ns));
  for (const int row : {WheelRows::speed, WheelRows::side, WheelRows::slope}) sigma(row) = std::hypot(sigma(row), late);
}

/// Each wheel by itself: the axle's speed and yaw rate predict how fast it should roll. Where the speed is measured
/// moves along the axle to the wheel that fits better, and its noise grows with what both have. A slip is no white
/// noise: so many readings share one error as come while it lasts.
void Wheels::score_wheels(WheelRows& rows, Sigmas& sigma, const WheelIncrement& increment, const Context& context,
                          const Ekf& ekf, Records& records) {
  const double half = 0.5 * ekf.state().odometer.track_width;
  const double noise = std::hypot(sigma(WheelRows::speed), half * sigma(WheelRows::yaw_rate));
  const double readings = readings_that_share(kSlipLasts, increment);
  std::array<double, 2> information{};
  for (std::size_t i = 0; i < 2; ++i) {
    const double side = i == 0 ? -half : half;
    const Eigen::Matrix<double, 1, kGroundColumns> H =
        rows.H.row(WheelRows::speed) + side * rows.H.row(WheelRows::yaw_rate);
    Innovation innovation =
        gate_test(ekf, H, rows.residual(WheelRows::speed) + side * rows.residual(WheelRows::yaw_rate), noise);
    NoiseScore& score = running_.wheel[i];
    const double factor = score.add(innovation, noise, config_.scores, increment.to_ns);
    information[i] = 1.0 / (1.0 + (factor - 1.0) * readings);
    innovation.fits = score.fits();
    innovation.score = context.weight * score.weight();
    records.log.add(i == 0 ? Source::wheel_left : Source::wheel_right, innovation, increment.to_ns);
    count(score, records.statistics);
  }
  const double sum = information[0] + information[1];
  const double lever = half * (information[1] - information[0]) / sum;
  rows.measure_at(lever);
  sigma(WheelRows::speed) =
      std::hypot(sigma(WheelRows::speed), lever * sigma(WheelRows::yaw_rate)) * std::sqrt(2.0 / sum);
}

/// The rows are those of one long increment: the velocity at its middle with which they all predict zero. Their
/// derivatives are taken there.
Displacement Wheels::displacement(const Ekf& ekf, const WheelIncrements& increments, const ImuBuffer& imu, TimeNs to_ns,
                                  bool ground_known) const {
  Displacement result;
  const State& x = ekf.state();
  WheelIncrement whole{x.imu.t_ns, to_ns};
  const auto stamp = [&x](TimeNs t_ns) { return later_by(-x.odometer.time_offset, t_ns); };
  const bool complete = for_each_part(increments, stamp(whole.from_ns), stamp(to_ns), [&](const IncrementPart& part) {
    whole.angle += part.angle;
    return true;
  });
  if (!complete || to_ns <= whole.from_ns || (uses_plane() && !ground_known)) return result;
  const double dt = whole.duration();
  const MeanRate rate = imu.mean_rate(whole.from_ns, to_ns);
  const Eigen::Matrix3d R_half = exp_so3(0.5 * dt * x.imu.rate_B(rate.gyro_B));
  const Eigen::Matrix3d R_WB = x.imu.R_WB * R_half;
  const auto rows_at = [&](const Eigen::Vector3d& v_B) {
    return linearize_wheels(x, R_WB, R_WB * v_B, whole, rate.gyro_B, config_.model, sees_ground_);
  };
  WheelRows rows = rows_at(Eigen::Vector3d::Zero());
  const Eigen::Matrix3d by_rows = rows.direction.inverse();
  const Eigen::Vector3d v_B = by_rows * rows.residual.head<3>();
  rows = rows_at(v_B);
  Eigen::Matrix<double, 3, kGroundColumns> H = rows.H.topRows<3>();
  H.middleCols<3>(ground_column(err::nu)).setZero();  // the velocity is what they show
  Eigen::Matrix3d covariance =
      H * ekf.covariance().matrix().block<kGroundColumns, kGroundColumns>(err::nu, err::nu) * H.transpose();
  const Noise noise = noise_of(rows, whole, rate, x, dt);
  covariance.diagonal() += noise.rows.head<3>().cwiseAbs2();
  covariance(WheelRows::speed, WheelRows::speed) += 2.0 * std::pow(noise.reading / dt, 2);
  const Eigen::Matrix3d J = dt * R_half * by_rows;
  result.p_BiBj = dt * R_half * v_B;
  result.covariance = J * covariance * J.transpose();
  result.available = result.p_BiBj.allFinite() && result.covariance.allFinite();
  return result;
}

bool Wheels::lifting(TimeNs t_ns) const {
  return running_.lifted_ns && seconds_between(*running_.lifted_ns, t_ns) < kStreamGap;
}

}  // namespace ear
