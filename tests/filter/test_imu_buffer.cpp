#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <random>

#include "filter/ingest/imu_buffer.h"
#include "tests/support/about.h"

using namespace ear;
using ear::test::about;

namespace {

/// gyro.x = t in seconds: the integral over [a, b] is (b^2 - a^2) / 2.
ImuBuffer ramp(std::size_t capacity, int count) {
  ImuBuffer buffer(capacity);
  for (int i = 0; i < count; ++i) {
    buffer.push({i * 10'000'000LL, {0.01 * i, 0.0, 0.0}, {0.0, 0.0, 9.81}});
  }
  return buffer;
}

double integral(const ImuBuffer& buffer, TimeNs from, TimeNs to) {
  double sum = 0.0;
  double duration = 0.0;
  buffer.for_each_piece(from, to, [&](const Eigen::Vector3d& gyro, const Eigen::Vector3d&, double dt) {
    sum += gyro.x() * dt;
    duration += dt;
  });
  CHECK(duration == doctest::Approx(seconds_between(from, to)));
  return sum;
}

}  // namespace

TEST_CASE("imu buffer: pieces add up to the integral, from and to anywhere") {
  const ImuBuffer buffer = ramp(100, 50);
  CHECK(integral(buffer, 0, 100'000'000) == doctest::Approx(0.005));
  CHECK(integral(buffer, 3'000'000, 27'000'000) == doctest::Approx(0.5 * (0.027 * 0.027 - 0.003 * 0.003)));
  CHECK(integral(buffer, 12'000'000, 14'000'000) == doctest::Approx(0.5 * (0.014 * 0.014 - 0.012 * 0.012)));
}

TEST_CASE("imu buffer: the newest sample is held beyond the end") {
  const ImuBuffer buffer = ramp(100, 11);  // ends at 0.1 s with 0.1 rad/s
  CHECK(integral(buffer, 100'000'000, 110'000'000) == doctest::Approx(0.001));
}

TEST_CASE("imu buffer: the oldest sample makes room") {
  const ImuBuffer buffer = ramp(10, 25);
  CHECK(buffer.size() == 10);
  CHECK(buffer[0].t_ns == 150'000'000);
  CHECK(buffer.newest().t_ns == 240'000'000);
  CHECK(integral(buffer, 200'000'000, 220'000'000) == doctest::Approx(0.5 * (0.22 * 0.22 - 0.20 * 0.20)));
}

TEST_CASE("imu buffer: statistics of an interval") {
  ImuBuffer buffer(20);
  for (int i = 0; i < 20; ++i) {
    const double sign = i % 2 == 0 ? 1.0 : -1.0;
    buffer.push({i * 5'000'000LL, {1.0 + 0.02 * sign, 0.0, 0.0}, {0.0, 0.0, 9.81 + 0.5 * sign}});
  }
  const ImuStatistics s = buffer.statistics(10'000'000, 45'000'000);
  CHECK(s.count == 8);
  CHECK(s.duration == doctest::Approx(0.035));
  CHECK(s.gyro_mean.x() == doctest::Approx(1.0));
  CHECK(s.gyro_spread == doctest::Approx(0.02));
  CHECK(s.accel_spread == doctest::Approx(0.5));
  // Steps of 0.04 in one of three axes, 5 ms apart: half of their mean square, times 5 ms.
  CHECK(s.gyro_density == doctest::Approx(0.04 * std::sqrt(0.005 / 6.0)));
  CHECK(s.accel_density == doctest::Approx(1.0 * std::sqrt(0.005 / 6.0)));
}

TEST_CASE("imu buffer: the standard error of the mean, as its halves show it") {
  ImuBuffer buffer(20);
  for (int i = 0; i < 20; ++i) {  // it turns slower, and is pushed the harder
    buffer.push({i * 5'000'000LL, {0.0, 0.0, i < 10 ? 0.05 : 0.01}, {i < 10 ? 0.2 : 0.6, 0.0, 9.81}});
  }
  const ImuStatistics changing = buffer.statistics(0, 100'000'000);
  CHECK(changing.gyro_mean.z() == doctest::Approx(0.03));
  CHECK(changing.gyro_error == doctest::Approx(0.02));
  CHECK(changing.accel_error == doctest::Approx(0.2));

  // Of white noise it is that of the mean: its standard deviation over the root of the number of samples.
  std::mt19937_64 rng{18};
  std::normal_distribution<double> normal;
  constexpr int kRuns = 2000, kSamples = 100;
  double squares = 0.0;
  for (int run = 0; run < kRuns; ++run) {
    ImuBuffer noisy(kSamples);
    for (int i = 0; i < kSamples; ++i) {
      noisy.push({i * 5'000'000LL, {0.0, 0.3 * normal(rng), 0.0}, Eigen::Vector3d::Zero()});
    }
    squares += std::pow(noisy.statistics(0, 1'000'000'000).gyro_error, 2) / kRuns;
  }
  CHECK(std::sqrt(squares) == about(0.03, 0.06));
}

TEST_CASE("imu buffer: the density of white noise, whatever the rate and the drift") {
  std::mt19937_64 rng{17};
  std::normal_distribution<double> normal;
  for (const double rate : {100.0, 400.0}) {
    ImuBuffer buffer(1000);
    const auto noise = [&](double density) {
      const double sigma = density * std::sqrt(rate);
      const double x = normal(rng), y = normal(rng), z = normal(rng);
      return Eigen::Vector3d(sigma * x, sigma * y, sigma * z);
    };
    for (int i = 0; i < 1000; ++i) {
      const double t = i / rate;
      const Eigen::Vector3d drift(0.1 * t, -0.05 * t, 1.0);
      buffer.push({static_cast<TimeNs>(1e9 * t), drift + noise(2e-3), drift + noise(3e-2)});
    }
    const ImuStatistics s = buffer.statistics(0, 20'000'000'000);
    CHECK(s.gyro_density == about(2e-3, 0.06));
    CHECK(s.accel_density == about(3e-2, 0.06));
  }
}

TEST_CASE("imu buffer: a piece has the larger noise of the samples at its ends; the mean rate has the largest") {
  ImuBuffer buffer = ramp(100, 11);
  for (const std::size_t age : {0U, 1U}) buffer.entry(age).noise = {5.0, 7.0};  // at 0.1 and 0.09 s
  const auto factor = [&](TimeNs from, TimeNs to) {
    double largest = 0.0;
    buffer.for_each_piece(from, to,
                          [&](const Eigen::Vector3d&, const Eigen::Vector3d&, double, const ImuNoiseFactors& noise) {
                            largest = std::max(largest, noise.accel);
                          });
    return largest;
  };
  CHECK(factor(0, 80'000'000) == 1.0);
  CHECK(factor(0, 81'000'000) == 7.0);
  CHECK(factor(101'000'000, 105'000'000) == 7.0);
  const MeanRate rate = buffer.mean_rate(40'000'000, 100'000'000);
  CHECK(rate.gyro_B.x() == doctest::Approx(0.07));
  CHECK(rate.noise_factor == 5.0);
  buffer.entry(0).noise = ImuNoiseFactors{};
  CHECK(factor(95'000'000, 100'000'000) == 7.0);
  CHECK(factor(101'000'000, 105'000'000) == 1.0);
}
