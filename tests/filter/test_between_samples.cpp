#include "filter/ingest/between_samples.h"

#include <doctest/doctest.h>

#include <cmath>
#include <functional>
#include <random>

using namespace ear;

namespace {

constexpr double kGyroNoise = 1e-3;  // [rad/s/sqrt(Hz)]

ImuCalibration imu() {
  ImuCalibration imu;
  imu.gyro_noise = kGyroNoise;
  imu.accel_noise = 1e-2;
  return imu;
}

/// The mean square of the factor on the gyroscope's noise over 20 s of samples of these rates.
double factor_of(double dt, const std::function<double(int)>& rate) {
  BetweenSamples between(imu());
  double sum = 0.0;
  const int count = static_cast<int>(20.0 / dt);
  for (int k = 0; k < count; ++k) {
    const Eigen::Vector3d gyro_B(rate(k), rate(k), rate(k));
    const double factor = between.add({std::llround(1e9 * k * dt), gyro_B, Eigen::Vector3d::Zero()}).gyro;
    sum += factor * factor / count;
  }
  return std::sqrt(sum);
}

}  // namespace

TEST_CASE("between samples: the error of the trapezoids over a random walk, by Monte-Carlo") {
  std::mt19937_64 rng{5};
  std::normal_distribution<double> normal;
  constexpr int kFine = 20;      // steps of the signal between two samples
  constexpr double kWalk = 3.0;  // [rad/s/sqrt(s)]: a body that shakes
  for (const double dt : {0.01, 0.03}) {
    CAPTURE(dt);
    std::vector<double> samples{0.0}, errors;
    double rate = 0.0;
    for (int k = 0; k < 20000; ++k) {
      const double before = rate;
      double integral = 0.0;
      for (int i = 0; i < kFine; ++i) {
        const double next = rate + kWalk * std::sqrt(dt / kFine) * normal(rng);
        integral += 0.5 * (rate + next) * dt / kFine;
        rate = next;
      }
      errors.push_back(integral - 0.5 * (before + rate) * dt);
      samples.push_back(rate);
    }
    double variance = 0.0;
    for (const double error : errors) variance += error * error / static_cast<double>(errors.size());
    BetweenSamples between(imu());
    double predicted = 0.0;
    for (std::size_t k = 0; k < samples.size(); ++k) {
      const Eigen::Vector3d gyro_B = Eigen::Vector3d::Constant(samples[k]);
      const double t = dt * static_cast<double>(k);
      const double factor = between.add({std::llround(1e9 * t), gyro_B, Eigen::Vector3d::Zero()}).gyro;
      predicted += (factor * factor - 1.0) * kGyroNoise * kGyroNoise * dt / static_cast<double>(samples.size());
    }
    CHECK(predicted < 1.1 * variance);
    CHECK(predicted > 0.6 * variance);  // the smaller of two noisy squares
  }
}

TEST_CASE(
    "between samples: white noise as stated, a smooth motion and an oscillation at the sampling limit add nothing") {
  std::mt19937_64 rng{6};
  std::normal_distribution<double> normal;
  const double dt = 0.005;
  CHECK(factor_of(dt, [&](int) { return kGyroNoise / std::sqrt(dt) * normal(rng); }) < 1.05);
  CHECK(factor_of(dt, [&](int k) { return 2.0 * std::sin(6.0 * k * dt); }) < 1.05);  // 1 Hz, 2 rad/s
  CHECK(factor_of(dt, [](int k) { return k % 2 == 0 ? 0.3 : -0.3; }) < 1.001);       // a rotor's vibration
}

TEST_CASE("between samples: a gap and what is not stated are no reason to count noise") {
  BetweenSamples between(imu());
  for (int k = 0; k < 100; ++k) {
    const TimeNs t_ns = k * 5'000'000LL + (k >= 50 ? 1'000'000'000LL : 0);
    const Eigen::Vector3d gyro_B = Eigen::Vector3d::Constant(k >= 50 ? 3.0 : 0.0);
    CHECK(between.add({t_ns, gyro_B, gyro_B}).gyro == 1.0);
  }
  BetweenSamples unstated(ImuCalibration{});
  for (int k = 0; k < 20; ++k) {
    const double factor =
        unstated.add({k * 5'000'000LL, Eigen::Vector3d::Constant(k % 3), Eigen::Vector3d::Zero()}).gyro;
    CHECK(std::isfinite(factor));
  }
}
