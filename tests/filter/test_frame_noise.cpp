// What one pair of images shows of the samples between them that no noise explains.
#include "filter/sources/frame_noise.h"

#include <doctest/doctest.h>

#include <cmath>
#include <limits>
#include <random>

using namespace ear;

namespace {

constexpr double kFrame = 0.05;                    // [s]
constexpr TimeNs kFrameNs = 50'000'000;            // the same
constexpr double kImages = 5e-4, kSamples = 1e-4;  // [rad] or [m], standard deviations
const ImuLimits kLimits{0.4, 0.8};

FrameNoise::Seen seen(const Eigen::Vector3d& beyond) {
  FrameNoise::Seen seen;
  seen.beyond = beyond;
  seen.others.setConstant(kImages * kImages);
  seen.noise.setConstant(kSamples * kSamples);
  seen.believed = 2.0;
  return seen;
}

double gyro_factor(const Eigen::Vector3d& beyond) {
  FrameNoise noise(kLimits);
  noise.add_turn(seen(beyond), kFrame);
  return noise.factors().gyro;
}

/// Displacements that agreed until `agreed` [s] before one that is off by `beyond` [m].
double accel_factor(double agreed, double beyond) {
  FrameNoise noise(kLimits);
  noise.add_way(seen(Eigen::Vector3d::Zero()), kFrame, 0);
  noise.add_way(seen({0.0, beyond, 0.0}), kFrame, static_cast<TimeNs>(1e9 * agreed));
  return noise.factors().accel;
}

}  // namespace

TEST_CASE("frame noise: what noise may explain changes nothing") {
  std::mt19937_64 rng{41};
  const double sigma = std::sqrt(kImages * kImages + 4.0 * kSamples * kSamples);
  std::normal_distribution<double> normal(0.0, sigma);
  FrameNoise noise(kLimits);
  int more = 0;
  for (TimeNs k = 0; k < 2000; ++k) {
    noise.start_frame();
    noise.add_turn(seen({normal(rng), normal(rng), normal(rng)}), kFrame);
    noise.add_way(seen({normal(rng), normal(rng), normal(rng)}), kFrame, k * kFrameNs);
    more += noise.factors().gyro > 1.0 || noise.factors().accel > 1.0 ? 1 : 0;
  }
  CHECK(more <= 4);  // 12,000 draws, of which 6e-5 are beyond four standard deviations
}

TEST_CASE("frame noise: a turn that noise does not explain is a standard deviation of the samples") {
  const double turn = 0.1 * kFrame;  // 0.1 rad/s
  const double factor = gyro_factor({0.0, 0.0, -turn});
  CHECK(std::hypot(kImages, factor * kSamples) == doctest::Approx(turn));
  CHECK(kSamples * gyro_factor({0.0, 0.41 * kFrame, 0.0}) == doctest::Approx(0.4 * kFrame));  // no more than the most
  CHECK(gyro_factor({turn, 2.0 * turn, turn}) == doctest::Approx(gyro_factor({0.0, 2.0 * turn, 0.0})));
}

TEST_CASE("frame noise: what no gyroscope is wrong by has another cause") {
  CHECK(gyro_factor({0.3 * kFrame, 0.0, 0.0}) > 1.0);
  CHECK(gyro_factor({0.6 * kFrame, 0.0, 0.0}) == 1.0);
  CHECK(gyro_factor({0.6 * kFrame, 0.1 * kFrame, 0.0}) > 1.0);  // about another axis it may be
}

TEST_CASE("frame noise: a velocity is off by what an accelerometer does since displacements agreed") {
  // 0.8 m/s^2 for a frame are 2 mm in the next one, besides four standard deviations, which are 2.2 mm.
  CHECK(accel_factor(kFrame, 0.003) > 1.0);
  CHECK(accel_factor(kFrame, 0.006) == 1.0);
  CHECK(accel_factor(4 * kFrame, 0.006) > 1.0);
  CHECK(accel_factor(20 * kFrame, 0.006) == 1.0);  // too long ago
  FrameNoise noise(kLimits);
  noise.add_way(seen({0.003, 0.0, 0.0}), kFrame, 0);
  CHECK(noise.factors().accel == 1.0);  // nothing agreed before
}

TEST_CASE("frame noise: an accelerometer that stays wrong is followed frame by frame, people at once are not") {
  FrameNoise wrong(kLimits), people(kLimits);
  for (TimeNs k = 0; k < 40; ++k) {
    const bool later = k >= 5;
    wrong.start_frame();
    wrong.add_way(seen({later ? 0.0025 : 0.0, 0.0, 0.0}), kFrame, k * kFrameNs);
    CHECK((wrong.factors().accel > 1.0) == later);
    people.start_frame();
    people.add_way(seen({later ? 1.5 * kFrame : 0.0, 0.0, 0.0}), kFrame, k * kFrameNs);  // 1.5 m/s
    CHECK(people.factors().accel == 1.0);
  }
}

TEST_CASE("frame noise: it is of one frame, and nothing that is no number gets into it") {
  FrameNoise noise(kLimits);
  noise.add_turn(seen({0.1 * kFrame, 0.0, 0.0}), kFrame);
  CHECK(noise.factors().gyro > 1.0);
  noise.start_frame();
  CHECK(noise.factors().gyro == 1.0);
  const double nan = std::numeric_limits<double>::quiet_NaN();
  noise.add_turn(seen({nan, 0.0, 0.0}), kFrame);
  noise.add_way(seen({0.0, nan, 0.0}), kFrame, kFrameNs);
  CHECK(noise.factors().gyro == 1.0);
  CHECK(noise.factors().accel == 1.0);
}

TEST_CASE("frame noise: the limits follow the priors of the biases") {
  PriorConfig prior;
  prior.gyro_bias = 0.1;
  prior.accel_bias = 0.08;
  CHECK(imu_limits(prior).gyro == doctest::Approx(0.4));
  CHECK(imu_limits(prior).accel == doctest::Approx(0.8));
}
