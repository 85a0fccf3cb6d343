#include "filter/sources/wheels/reading_noise.h"

#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <random>

#include "filter/sources/wheels/wheels.h"
#include "tests/support/about.h"
#include "tests/support/hand_made_drive.h"

using namespace ear;
using namespace ear::test;

namespace {

constexpr double kRate = 40.0;  // [Hz]

/// The mean of what a wheel shows in a minute whose path after t seconds is `path`; a reading is off by `noise`, and
/// taken so many seconds beside its stamp.
double shown(const std::function<double(double)>& path, double noise, double late) {
  std::mt19937_64 rng{3};
  std::normal_distribution<double> normal;
  ReadingNoise readings;
  double sum = 0.0, before = path(0.0);
  int count = 0;
  for (int i = 1; i < 60 * kRate; ++i) {
    const WheelIncrement increment{
        static_cast<TimeNs>(1e9 * (i - 1) / kRate), static_cast<TimeNs>(1e9 * i / kRate), {}};
    const double reading = path(i / kRate + late * normal(rng)) + noise * normal(rng);
    readings.add((reading - before) / increment.duration(), increment);
    before = reading;
    if (i < 5 * kRate) continue;
    sum += readings.of_increment();
    ++count;
  }
  return sum / count;
}

struct End {
  double error = 0.0, sigma = 0.0;  // [m]
};

/// Along the path, a minute after it was known, at 0.5 m/s with a poor accelerometer, by readings that are off by
/// `noise` [m] where nothing is stated. They had five seconds before to show it.
End after_a_minute(double noise, std::uint64_t seed) {
  constexpr double kSpeed = 0.5, kRadius = 0.1, kImuStep = 0.005, kKnown = 5.0, kEnd = 65.0;
  std::mt19937_64 rng{seed};
  std::normal_distribution<double> normal;
  Calibration calibration = two_wheels(kRadius, 0.4);
  calibration.imu.accel_noise = 0.05;
  calibration.encoder->rate_hz = kRate;
  Ekf ekf(FilterConfig{}, calibration);
  const auto path = [&](TimeNs t_ns) { return kSpeed * seconds_between(stamp(0.0), t_ns); };
  const auto start = [&](double t) {
    ImuState x;
    x.t_ns = stamp(t);
    x.p_WB.x() = path(x.t_ns);
    x.v_W.x() = kSpeed;
    ekf.start(x, Eigen::VectorXd::Constant(err::clones, 1e-9));
  };
  start(0.0);
  ImuBuffer imu(16384);
  for (double t = -0.1; t < kEnd + 0.1; t += kImuStep) {
    const double accel = calibration.imu.accel_noise / std::sqrt(kImuStep) * normal(rng);
    imu.push({stamp(t), Eigen::Vector3d::Zero(), {accel, 0.0, 9.81}});
  }
  Wheels wheels(OdometerConfig{}, calibration, false);
  Records records;
  double before = 0.0;
  for (int i = 1; i < kEnd * kRate; ++i) {
    const double t = i / kRate;
    const double angle = (kSpeed * t + noise * normal(rng)) / kRadius;
    const WheelIncrement turn{stamp(t - 1.0 / kRate), stamp(t), Eigen::Vector2d::Constant(angle - before)};
    before = angle;
    if (i == kKnown * kRate) start(t - 1.0 / kRate);
    ekf.propagate(imu, middle_of(turn), {}, 0.0);
    wheels.watch(turn);
    wheels.update(turn, {imu}, ekf, records);
  }
  const ImuState& end = ekf.state().imu;
  return {end.p_WB.x() - path(end.t_ns), std::sqrt(ekf.covariance().matrix()(err::rho, err::rho))};
}

double steady(double t) { return 0.5 * t; }
double to_and_fro(double t) { return 0.3 * std::sin(2.0 * t); }

}  // namespace

TEST_CASE("reading noise: it is found, whatever the motion") {
  for (const double noise : {3e-4, 3e-3}) {
    CHECK(shown(steady, noise, 0.0) == about(std::sqrt(2.0) * noise, 0.1));
    CHECK(shown(to_and_fro, 10.0 * noise, 0.0) == about(std::sqrt(2.0) * 10.0 * noise, 0.1));
  }
}

TEST_CASE("reading noise: stamps that scatter are noise of what moves") {
  CHECK(shown(steady, 0.0, 3e-3) == about(std::sqrt(2.0) * 0.5 * 3e-3, 0.1));
}

TEST_CASE("reading noise: motion is none, nor is a slip") {
  CHECK(shown(steady, 0.0, 0.0) < 1e-9);
  CHECK(shown(to_and_fro, 0.0, 0.0) < 1e-9);
  CHECK(shown([](double t) { return 0.5 * t + 0.3 * std::clamp(t - 20.0, 0.0, 1.0); }, 0.0, 0.0) < 1e-4);
}

TEST_CASE("reading noise: after a gap it begins with what is known, and takes no step across it") {
  ReadingNoise readings;
  TimeNs t_ns = 0;
  const auto add = [&](double speed, TimeNs gap) {
    const WheelIncrement increment{t_ns + gap, t_ns + gap + 25'000'000, {}};
    readings.add(speed, increment);
    t_ns = increment.to_ns;
  };
  for (int i = 0; i < 100; ++i) add(0.5, 0);
  for (int i = 0; i < 100; ++i) add(i % 2 == 0 ? 5.0 : -5.0, 1'000'000'000);
  CHECK(readings.of_increment() == 0.0);
  for (int i = 0; i < 100; ++i) add(i % 2 == 0 ? 0.6 : 0.4, 0);
  CHECK(readings.of_increment() > 0.0);
}

TEST_CASE("reading noise: however far the way, the path is as well known as a reading shows it, and as it says") {
  constexpr double kNoise = 0.01;  // [m]
  constexpr int kDrives = 20;
  double squares = 0.0, relative = 0.0;
  for (std::uint64_t seed = 1; seed <= kDrives; ++seed) {
    const End end = after_a_minute(kNoise, seed);
    squares += end.error * end.error / kDrives;
    relative += std::pow(end.error / end.sigma, 2) / kDrives;
  }
  CHECK(std::sqrt(squares) < 1.5 * kNoise);
  CHECK(relative > 0.4);
  CHECK(relative < 2.0);
}
