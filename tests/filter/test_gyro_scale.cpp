// A gyroscope that measures all turns too large, on a vehicle without a camera: what the covariance says of it is what
// it does to the estimate.
#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <optional>

#include "filter/filter.h"
#include "tests/support/hand_made_drive.h"

using namespace ear;
using namespace ear::test;

namespace {

constexpr double kStep = 0.01;  // [s]
constexpr double kDuration = 40.0;
constexpr double kRadius = 0.1;
constexpr double kTrack = 0.4;

/// Stands for two seconds, then drives in the plane: left turns of changing rate, with a turn to the right in between.
double speed(double t) { return t < 2.0 ? 0.0 : 0.8 * (1.0 - std::exp(-(t - 2.0))); }
double acceleration(double t) { return t < 2.0 ? 0.0 : 0.8 * std::exp(-(t - 2.0)); }
double yaw_rate(double t) { return t < 3.0 ? 0.0 : 0.25 + 0.35 * std::sin(0.3 * (t - 3.0)); }

/// At the end, with a gyroscope that measures (1 + `scale`) times the rate.
Estimate drive(double scale, const FilterConfig& config, const Eigen::Matrix3d& told = Eigen::Matrix3d::Identity()) {
  Calibration calibration = two_wheels(kRadius, kTrack);
  calibration.imu.gyro_matrix = told;
  Filter filter(config, calibration);
  std::optional<Estimate> last;
  double left = 0.0, right = 0.0;  // [m] rolled
  const int steps = static_cast<int>(kDuration / kStep);
  for (int k = 0; k <= steps; ++k) {
    const double t = k * kStep;
    filter.add_imu(
        {stamp(t), {0.0, 0.0, (1.0 + scale) * yaw_rate(t)}, {acceleration(t), speed(t) * yaw_rate(t), 9.81}});
    const auto counts = [&](double metres) {
      return static_cast<std::int64_t>(
          std::llround(metres / (2.0 * M_PI * kRadius) * static_cast<double>(calibration.encoder->resolution)));
    };
    filter.add_encoder({stamp(t), counts(left), counts(right)});
    if (k % 5 == 0) last = filter.process_without_image(stamp(t));
    const double middle = t + 0.5 * kStep;
    left += kStep * (speed(middle) - 0.5 * kTrack * yaw_rate(middle));
    right += kStep * (speed(middle) + 0.5 * kTrack * yaw_rate(middle));
  }
  REQUIRE(last);
  return *last;
}

/// Over a ramp, up and down at 17 degrees, with a gyroscope that measures 8 % too little. Nose-down angles are
/// positive.
double pitch(double t) {
  const auto step = [t](double at) { return 1.0 / (1.0 + std::exp(-12.0 * (t - at))); };
  return 0.3 * (-step(6.0) + 2.0 * step(8.0) - step(10.0));
}

struct Ramp {
  double accused = 0.0;  ///< [s] for which a wheel is, or it is lost
  double worst = 0.0;    ///< [m/s] error of the speed
};

Ramp drive_over_ramp(const FilterConfig& config) {
  const Calibration calibration = two_wheels(kRadius, kTrack);
  Filter filter(config, calibration);
  Ramp result;
  double rolled = 0.0;  // [m] of each wheel against the body
  for (int k = 0; k <= static_cast<int>(14.0 / kStep); ++k) {
    const double t = k * kStep;
    const double rate = (pitch(t + 1e-4) - pitch(t - 1e-4)) / 2e-4;
    const Eigen::Vector3d force_B(acceleration(t) - 9.81 * std::sin(pitch(t)), 0.0,
                                  9.81 * std::cos(pitch(t)) - speed(t) * rate);
    filter.add_imu({stamp(t), {0.0, 0.92 * rate, 0.0}, force_B});
    const auto count = static_cast<std::int64_t>(
        std::llround(rolled / (2.0 * M_PI * kRadius) * static_cast<double>(calibration.encoder->resolution)));
    filter.add_encoder({stamp(t), count, count});
    rolled += kStep * speed(t + 0.5 * kStep) - kRadius * (pitch(t + kStep) - pitch(t));
    if (k % 5 != 0) continue;
    const std::optional<Estimate> estimate = filter.process_without_image(stamp(t));
    if (t < 3.0) continue;
    result.accused += !estimate || estimate->health.faulty.any() ? 5 * kStep : 0.0;
    if (!estimate) continue;
    result.worst = std::max(result.worst, std::abs(estimate->state.v_W.norm() - speed(t)));
  }
  return result;
}

double yaw(const Estimate& estimate) {
  const Eigen::Matrix3d R = estimate.state.q_WB.toRotationMatrix();
  return std::atan2(R(1, 0), R(0, 0));
}

}  // namespace

TEST_CASE("gyroscope's scale: its share of the covariance is what it does to attitude, velocity and position") {
  FilterConfig config;
  config.odometer.yaw_rate_sigma = 100.0;  // the wheels do not show the turn
  const double sigma = config.prior.gyro_unseen;
  REQUIRE(sigma > 0.0);
  FilterConfig sure = config;
  sure.prior.gyro_unseen = 0.0;
  const Estimate right = drive(0.0, config);
  const auto share = (right.covariance - drive(0.0, sure).covariance).eval();

  constexpr double kScale = 1e-3;
  const Estimate wrong = drive(kScale, config);
  const Eigen::Vector3d by_yaw(0.0, 0.0, std::remainder(yaw(wrong) - yaw(right), 2.0 * M_PI) / kScale);
  const Eigen::Vector3d by_velocity = (wrong.state.v_W - right.state.v_W) / kScale;
  const Eigen::Vector3d by_position = (wrong.state.p_WB - right.state.p_WB) / kScale;
  CAPTURE(by_yaw.transpose());
  CAPTURE(by_position.transpose());
  REQUIRE(by_yaw.norm() > 5.0);  // it turned all the way around
  REQUIRE(by_position.norm() > 20.0);
  namespace at = estimate_error;
  const auto near = [&](int block, const Eigen::Vector3d& J) {
    const Eigen::Matrix3d expected = sigma * sigma * J * J.transpose();
    return (share.block<3, 3>(block, block) - expected).norm() < 0.05 * expected.norm();
  };
  CHECK(near(at::rotation, by_yaw));
  CHECK(near(at::velocity, by_velocity));
  CHECK(near(at::position, by_position));
  const Eigen::Matrix3d cross = sigma * sigma * by_position * by_yaw.transpose();
  CHECK((share.block<3, 3>(at::position, at::rotation) - cross).norm() < 0.05 * cross.norm());
}

TEST_CASE("gyroscope's scale: a matrix that is given undoes it") {
  const FilterConfig config;
  const Estimate exact = drive(0.0, config);
  const Estimate told = drive(0.02, config, Eigen::Vector3d(1.0, 1.0, 1.0 / 1.02).asDiagonal().toDenseMatrix());
  const Estimate not_told = drive(0.02, config);
  CHECK((told.state.p_WB - exact.state.p_WB).norm() < 1e-6);
  CHECK((not_told.state.p_WB - exact.state.p_WB).norm() > 0.1);
}

TEST_CASE("gyroscope's scale: on a ramp the wheels are believed, not the tilt that it makes") {
  const FilterConfig config;
  const Ramp believed = drive_over_ramp(config);
  CHECK(believed.accused == 0.0);
  CHECK(believed.worst < 0.05);
  FilterConfig sure = config;
  sure.prior.gyro_unseen = 0.0;
  const Ramp accused = drive_over_ramp(sure);
  CHECK(accused.accused > 2.0);
  CHECK(accused.worst > 0.1);
}
