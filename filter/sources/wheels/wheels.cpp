#include "filter/sources/wheels/wheels.h"

#include <cmath>
#include <initializer_list>

#include "filter/ekf/propagation.h"
#include "filter/sources/wheels/wheel_displacement.h"

namespace ear {
namespace {

constexpr double kErrorTime = 0.5;  // [s] chosen: the contradiction of two wheels is one error for so long
constexpr double kLifting = 0.3;    // [s] chosen: after wheels that leave the ground, or meet it, as it seems

}  // namespace

Wheels::Wheels(const OdometerConfig& config, const Calibration& calibration, bool sees_ground)
    : config_(config), encoder_(*calibration.encoder), imu_(calibration.imu), sees_ground_(sees_ground) {}

void Wheels::update(const WheelIncrement& increment, const Context& context, Ekf& ekf, Records& records) {
  const State& x = ekf.state();
  const BodyMotion motion = motion_at(middle_of(increment), x.imu, context.imu);
  const MeanRate rate = context.imu.mean_rate(increment.from_ns, increment.to_ns);
  WheelRows rows = linearize_wheels(x, motion.R_WB, motion.v_W, increment, rate.gyro_B, config_.model, sees_ground_);
  Sigmas sigma = noise_of(rows, increment, rate, x);
  log(rows, sigma, increment.to_ns, ekf, records.log);

  // Without lasers, roll and the gyroscope's bias are set apart by nothing else: both turn the path sideways.
  const bool terrain = config_.model == OdometerModel::terrain;
  const bool use_yaw_rate =
      config_.model == OdometerModel::differential || config_.yaw_rate || (terrain && !sees_ground_);
  const bool slope_known = !uses_plane() || context.ground_known;
  const bool speed_known = choose_wheel(rows, sigma, increment, ekf, records.statistics);
  const std::array<bool, WheelRows::size> use = {speed_known, true, slope_known,
                                                 use_yaw_rate && running_.agreement.agree()};
  GroundRows<WheelRows::size> z;
  std::array<int, WheelRows::size> row_of{};
  for (int row = 0; row < WheelRows::size; ++row) {
    if (!use[static_cast<std::size_t>(row)]) continue;
    z.H.row(z.count) = rows.H.row(row);
    z.residual(z.count) = rows.residual(row);
    z.sigma(z.count) = sigma(row);
    row_of[static_cast<std::size_t>(z.count++)] = row;
  }
  ekf.apply(z, context.weight, context.calibration, [&](int i, const Innovation& innovation) {
    const int row = row_of[static_cast<std::size_t>(i)];
    if (row == WheelRows::slope && !innovation.fits) running_.lifted_ns = increment.to_ns;
    const bool used =
        agrees_again(running_.agrees_since_ns[static_cast<std::size_t>(row)], innovation.fits, increment.to_ns);
    ++(used ? records.statistics.wheel_rows_used : records.statistics.wheel_rows_rejected);
    return used;
  });
}

/// What slips or bumps is white in the distance; the counts and the gyroscope add their own.
Wheels::Sigmas Wheels::noise_of(const WheelRows& rows, const WheelIncrement& increment, const MeanRate& rate,
                                const State& x) const {
  const double dt = increment.duration();
  const double per_root_metre = std::sqrt(std::abs(rows.wheel_speed) / dt);
  const double yaw_rate = (rate.gyro_B - x.imu.b_g).norm();
  const double gyro_noise = rate.noise_factor * imu_.gyro_noise / std::sqrt(dt);
  const double count_noise = std::sqrt(2.0) * encoder_.noise_counts * 2.0 * M_PI /
                             static_cast<double>(encoder_.resolution) / dt * x.odometer.wheel_radius.mean() /
                             std::sqrt(2.0);
  // On springs and tyres the body does not point along its path, and no laser shows by how much.
  const double sway = sees_ground_ ? 0.0 : std::abs(rows.wheel_speed) / std::sqrt(dt);  // [m/s] per [rad sqrt(s)]
  const auto root_sum = [&](int row, std::initializer_list<double> sigmas) {
    double variance = 0.0;
    for (const double s : sigmas) variance += s * s;
    const double gyro = gyro_noise * rows.J_gyro.row(row).norm();
    return std::sqrt(variance + gyro * gyro);
  };
  const double floor = config_.speed_sigma;
  Sigmas sigma;
  sigma << root_sum(WheelRows::speed, {floor, config_.slip * per_root_metre, count_noise}),
      root_sum(WheelRows::side,
               {floor, config_.side_slip * per_root_metre, config_.side_slip_turn * yaw_rate, config_.body_yaw * sway}),
      root_sum(WheelRows::slope, {floor, config_.roughness * per_root_metre, config_.body_pitch * sway}),
      root_sum(WheelRows::yaw_rate, {config_.yaw_rate_sigma, count_noise * 2.0 / x.odometer.track_width});
  return sigma;
}

/// Where the wheels contradict each other by the gyroscope, the one that agrees with the state gives the speed. False
/// if none does. If both do, it lies somewhere between them.
bool Wheels::choose_wheel(WheelRows& rows, Sigmas& sigma, const WheelIncrement& increment, const Ekf& ekf,
                          FrameStatistics& statistics) {
  const double half = 0.5 * ekf.state().odometer.track_width;
  WheelAgreement& agreement = running_.agreement;
  const bool agreed = agreement.agree();
  agreement.add(2.0 * half * rows.residual(WheelRows::yaw_rate),
                2.0 * half * std::sqrt(ekf.covariance().variance(rows.H.row(WheelRows::yaw_rate), err::nu)),
                increment.to_ns);
  if (agreement.agree()) return true;
  if (agreed) running_.wheel_agrees_since_ns.fill(kDisagrees);  // the state may have followed the wrong one a little

  const double sigma_one = std::hypot(sigma(WheelRows::speed), half * sigma(WheelRows::yaw_rate));
  std::array<WheelRows, 2> one = {rows, rows};
  std::array<bool, 2> fits{};
  for (std::size_t wheel = 0; wheel < 2; ++wheel) {
    one[wheel].take_one_wheel(wheel == 0 ? -half : half);
    const Innovation innovation =
        ekf.test(one[wheel].H.row(WheelRows::speed), one[wheel].residual(WheelRows::speed), sigma_one);
    fits[wheel] = agrees_again(running_.wheel_agrees_since_ns[wheel], innovation.fits, increment.to_ns);
  }
  if (fits[0] && fits[1]) {
    const double between = 0.5 * agreement.difference() * std::sqrt(kErrorTime / increment.duration());
    sigma(WheelRows::speed) = std::hypot(sigma(WheelRows::speed), between);
    return true;
  }
  if (!fits[0] && !fits[1]) {
    ++statistics.wheel_rows_rejected;
    return false;
  }
  rows = one[fits[0] ? 0 : 1];
  sigma(WheelRows::speed) = sigma_one;
  return true;
}

/// Each wheel by itself: the axle's speed and yaw rate predict how fast it should roll.
void Wheels::log(const WheelRows& rows, const Sigmas& sigma, TimeNs t_ns, const Ekf& ekf, InnovationLog& log) const {
  const double lever = 0.5 * ekf.state().odometer.track_width;
  for (const Source wheel : {Source::wheel_left, Source::wheel_right}) {
    const double side = wheel == Source::wheel_left ? -lever : lever;
    const Eigen::Matrix<double, 1, kGroundColumns> H =
        rows.H.row(WheelRows::speed) + side * rows.H.row(WheelRows::yaw_rate);
    const double noise = std::hypot(sigma(WheelRows::speed), side * sigma(WheelRows::yaw_rate));
    const double innovation = rows.residual(WheelRows::speed) + side * rows.residual(WheelRows::yaw_rate);
    log.add(wheel, ekf.test(H, innovation, noise), t_ns);
  }
}

Displacement Wheels::displacement(const Ekf& ekf, const WheelIncrements& increments, const ImuBuffer& imu, TimeNs to_ns,
                                  bool ground_known) const {
  if (uses_plane() && !ground_known) return {};
  const WheelSetting setting{wheel_model(ekf.state().odometer), wheel_noise(config_, encoder_, imu_),
                             config_.speed_sigma, config_.side_slip_turn, uses_plane()};
  return wheel_displacement(ekf.state(), ekf.covariance(), increments, imu, to_ns, setting);
}

bool Wheels::lifting(TimeNs t_ns) const {
  return running_.lifted_ns && seconds_between(*running_.lifted_ns, t_ns) < kLifting;
}

}  // namespace ear
