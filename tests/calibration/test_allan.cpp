#include <doctest/doctest.h>

#include <cmath>
#include <random>

#include "calibration/allan.h"
#include "tests/support/about.h"

using namespace ear;
using namespace ear::calibration;
using ear::test::about;

namespace {

constexpr double kInterval = 0.01;  // [s]

std::vector<double> signal_of(unsigned seed, double seconds, double white, double walk) {
  std::mt19937_64 rng{seed};
  std::normal_distribution<double> normal;
  std::vector<double> signal(static_cast<std::size_t>(seconds / kInterval));
  double bias = 0.3;
  for (double& value : signal) {
    value = bias + white / std::sqrt(kInterval) * normal(rng);
    bias += walk * std::sqrt(kInterval) * normal(rng);
  }
  return signal;
}

}  // namespace

TEST_CASE("allan: white noise is found within its uncertainty, and no walk is claimed where there is none") {
  double squares = 0.0;
  for (unsigned seed = 1; seed <= 20; ++seed) {
    CAPTURE(seed);
    const AllanResult found = allan(signal_of(seed, 60.0, 1e-3, 0.0), kInterval);
    REQUIRE(found.white);
    CHECK(found.white->value == about(1e-3, 0.1));
    squares += std::pow((found.white->value - 1e-3) / found.white->sigma, 2) / 20.0;
    CHECK_FALSE(found.random_walk);
    CHECK(found.walk_below > 0.0);
  }
  CHECK(squares < 2.5);
}

TEST_CASE("allan: a random walk is found where the recording is long enough, and only there") {
  double mean = 0.0;
  for (unsigned seed = 1; seed <= 10; ++seed) {
    CAPTURE(seed);
    const AllanResult found = allan(signal_of(seed, 3600.0, 1e-3, 1e-4), kInterval);
    REQUIRE(found.random_walk);
    CHECK(std::abs(found.random_walk->value - 1e-4) < 4.0 * found.random_walk->sigma);
    mean += found.random_walk->value / 10.0;
    CHECK(found.white->value == about(1e-3, 0.1));
    CHECK_FALSE(allan(signal_of(seed, 5.0, 1e-3, 1e-4), kInterval).random_walk);
  }
  CHECK(mean == about(1e-4, 0.1));
}

TEST_CASE("allan: the stretch at rest is the one that neither moves nor shakes") {
  std::mt19937_64 rng{3};
  std::normal_distribution<double> normal;
  std::vector<ImuSample> imu;
  for (int i = 0; i < 4000; ++i) {
    ImuSample sample;
    sample.t_ns = i * 10'000'000LL;
    const double noise = i < 1500 ? 0.1 : 0.01;  // rotors run for 15 s, then it stands for 15 s, then it turns
    for (int axis = 0; axis < 3; ++axis) {
      sample.gyro_B(axis) = noise * normal(rng) + (i > 3000 ? 0.2 : 0.0);
      sample.accel_B(axis) = noise * normal(rng) + (axis == 2 ? 9.81 : 0.0);
    }
    imu.push_back(sample);
  }
  const ImuNoise noise = noise_at_rest(imu);
  CHECK(noise.duration == about(15.0, 0.05));
  for (const AllanResult& axis : noise.axes) CHECK(axis.white->value == about(1e-3, 0.1));
  imu.resize(120);
  CHECK_THROWS_WITH(static_cast<void>(noise_at_rest(imu)), doctest::Contains("s at most"));
}

namespace {

/// Swings of 2 Hz and 1 rad/s after 5 s of rest; in motion the noise is so many times as large.
std::vector<ImuSample> swinging(unsigned seed, double gyro_times, double accel_times, double moving) {
  std::mt19937_64 rng{seed};
  std::normal_distribution<double> normal;
  std::vector<ImuSample> imu;
  for (int i = 0; i < static_cast<int>(200.0 * (5.0 + moving)); ++i) {
    const double t = i / 200.0 - 5.0;
    ImuSample sample{i * 5'000'000LL, Eigen::Vector3d::Zero(), {0.0, 0.0, 9.81}};
    const double swing = t > 0.0 ? std::sin(12.6 * t) : 0.0;
    for (int axis = 0; axis < 3; ++axis) {
      sample.gyro_B(axis) += 0.014 * (t > 0.0 ? gyro_times : 1.0) * normal(rng) + (axis == 1 ? swing : 0.0);
      sample.accel_B(axis) += 0.14 * (t > 0.0 ? accel_times : 1.0) * normal(rng) + (axis == 0 ? 2.0 * swing : 0.0);
    }
    imu.push_back(sample);
  }
  return imu;
}

}  // namespace

TEST_CASE("noise in motion: what rotors add is told from the motion itself") {
  for (const double times : {1.0, 3.0}) {
    CAPTURE(times);
    const std::vector<ImuSample> imu = swinging(4, times, 2.0 * times, 10.0);
    const MotionNoise found = noise_in_motion(noise_at_rest(imu), imu);
    CHECK(found.duration == about(10.0, 0.06));
    for (std::size_t axis = 0; axis < 6; ++axis) {
      CAPTURE(axis);
      CHECK(found.times[axis].value == about(axis < 3 ? times : 2.0 * times, 0.15));
      CHECK(found.times[axis].sigma < 0.12 * found.times[axis].value);
    }
  }
}

TEST_CASE("noise in motion: no motion, and another rate, are errors in words") {
  const std::vector<ImuSample> imu = swinging(5, 1.0, 1.0, 0.5);
  const ImuNoise rest = noise_at_rest(imu);
  CHECK_THROWS_WITH(static_cast<void>(noise_in_motion(rest, imu)), doctest::Contains("3 s are needed"));
  std::vector<ImuSample> slow;
  for (std::size_t i = 0; i < imu.size(); i += 2) slow.push_back(imu[i]);
  CHECK_THROWS_WITH(static_cast<void>(noise_in_motion(rest, slow)), doctest::Contains("another rate"));
}
