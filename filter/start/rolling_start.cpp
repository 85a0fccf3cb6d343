#include "filter/start/rolling_start.h"

#include <cmath>

#include "filter/ekf/so3.h"
#include "filter/ingest/limits.h"
#include "filter/start/start_fit.h"
#include "filter/start/start_sums.h"

namespace ear {
namespace {

constexpr double kSpeedSigma = 0.02;      // [m/s] chosen: the least of a speed
constexpr double kDirectionSigma = 0.05;  // [rad] chosen: of the velocity in the body, which pitches about the axle

}  // namespace

Reason lacking_for_rolling_start(const ImuBuffer& imu, const Ring<WheelIncrement>& turns, TimeNs now_ns,
                                 double min_duration) {
  if (turns.empty() || seconds_between(turns.back().to_ns, now_ns) > kStale) return Reason::wheel_gaps;
  for (std::size_t k = 1; k < turns.size(); ++k) {
    if (turns[k].from_ns != turns[k - 1].to_ns) return Reason::wheel_gaps;
  }
  const TimeNs start_ns = turns.front().from_ns;
  if (imu.empty() || imu[0].t_ns > start_ns) return Reason::few_samples;
  return seconds_between(start_ns, turns.back().to_ns) < min_duration ? Reason::few_readings : Reason::none;
}

StartAttempt rolling_start(const ImuBuffer& imu, const Ring<WheelIncrement>& turns, const OdometerState& odometer,
                           const StartFit::Vector& prior_sigma, double stamp_sigma, double shown_noise) {
  const TimeNs start_ns = turns.front().from_ns;
  StartFit fit(prior_sigma);
  StartSums sums;
  const double usual_dt = seconds_between(start_ns, turns.back().to_ns) / static_cast<double>(turns.size());
  TimeNs now_ns = start_ns;
  for (std::size_t k = 0; k < turns.size(); ++k) {
    const WheelIncrement& turn = turns[k];
    const TimeNs middle_ns = middle_of(turn);
    Eigen::Vector3d rate = Eigen::Vector3d::Zero();
    imu.for_each_piece(now_ns, middle_ns,
                       [&](const Eigen::Vector3d& gyro_B, const Eigen::Vector3d& accel_B, double dt) {
                         sums.add(gyro_B, accel_B, dt);
                         rate = gyro_B;
                       });
    now_ns = middle_ns;
    const Eigen::Matrix3d& R_BO = odometer.T_BO.R;
    const double speed = odometer.wheel_radius.dot(turn.angle) / (2.0 * turn.duration()) +
                         odometer.wheel_radius.mean() * R_BO.col(1).dot(rate);
    const Eigen::Vector3d u = sums.R * (speed * R_BO.col(0) - rate.cross(odometer.T_BO.p));
    StartFit::Rows H = StartFit::Rows::Zero();
    H.middleCols<3>(StartFit::velocity).setIdentity();
    H.middleCols<3>(StartFit::gravity) = seconds_between(start_ns, middle_ns) * Eigen::Matrix3d::Identity();
    H.middleCols<3>(StartFit::gyro_bias) = sums.velocity_by_b_g + skew(u) * sums.R_by_b_g;
    H.middleCols<3>(StartFit::accel_bias) = sums.velocity_by_b_a();
    const Eigen::Vector3d z = u - sums.velocity;
    const double stamps = std::max(std::sqrt(2.0) * stamp_sigma * std::abs(speed), shown_noise);
    const double sigma =
        std::hypot(kSpeedSigma, kDirectionSigma * speed, stamps / std::sqrt(usual_dt * turn.duration()));
    fit.add(H, z, sigma * sigma);
  }
  const std::optional<StartFit::Vector> x = fit.solve();
  if (!x) return {std::nullopt, Reason::wheels_contradict};
  return {start_state(start_ns, *x), Reason::none};
}

}  // namespace ear
