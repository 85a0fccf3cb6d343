#include "filter/ingest/repeat_guard.h"

#include <doctest/doctest.h>

#include <cmath>
#include <random>

#include "tests/support/random_state.h"

using namespace ear;
using namespace ear::test;

namespace {

/// An inertial sensor of 200 Hz at rest, which reads in steps of `resolution` times its noise.
class Sensor {
 public:
  explicit Sensor(double resolution = 0.0) : resolution_(resolution) {}

  [[nodiscard]] ImuSample next() {
    t_ns_ += 5'000'000;
    return {t_ns_, read(), read()};
  }
  /// The last one again, with a new stamp.
  [[nodiscard]] ImuSample again(ImuSample sample) {
    sample.t_ns = t_ns_ += 5'000'000;
    return sample;
  }

 private:
  Eigen::Vector3d read() {
    const Eigen::Vector3d value = random_vector(rng_, 1.0);
    return resolution_ > 0.0 ? Eigen::Vector3d(resolution_ * (value / resolution_).array().round()) : value;
  }

  double resolution_;
  TimeNs t_ns_ = 0;
  std::mt19937_64 rng_{8};
};

/// Share of so many samples that are refused.
double refused(Sensor& sensor, RepeatGuard& guard, int samples) {
  int count = 0;
  for (int i = 0; i < samples; ++i) count += guard.repeats(sensor.next()) ? 1 : 0;
  return static_cast<double>(count) / samples;
}

}  // namespace

TEST_CASE("samples that repeat: a driver that hangs is found at the third repeat, whenever it does") {
  Sensor sensor;
  RepeatGuard guard;
  for (int hang = 0; hang < 5; ++hang) {
    CHECK(refused(sensor, guard, 1000) == 0.0);
    const ImuSample held = sensor.next();
    CHECK_FALSE(guard.repeats(held));
    int taken = 0;
    for (int i = 0; i < 20; ++i) taken += guard.repeats(sensor.again(held)) ? 0 : 1;
    CAPTURE(hang);
    CHECK(taken < (hang == 0 ? 3 : 5));  // what hung before may be chance
    CHECK_FALSE(guard.repeats(sensor.next()));
  }
}

TEST_CASE("samples that repeat: coarse steps at rest are no driver that hangs") {
  for (const double resolution : {3.0, 5.0, 8.0}) {
    CAPTURE(resolution);
    Sensor sensor(resolution);
    RepeatGuard guard;
    CHECK(refused(sensor, guard, 200000) < 2e-3);
  }
}

TEST_CASE("samples that repeat: a driver faster than its sensor gives each sample several times") {
  Sensor sensor;
  RepeatGuard guard;
  for (int i = 0; i < 2000; ++i) {
    const ImuSample sample = sensor.next();
    CHECK_FALSE(guard.repeats(sample));
    for (int again = 0; again < 3; ++again) CHECK_FALSE(guard.repeats(sensor.again(sample)));
  }
}

TEST_CASE("samples that repeat: those of a simulation without noise are the same at rest") {
  RepeatGuard guard;
  TimeNs t_ns = 0;
  for (int second = 0; second < 20; ++second) {
    const bool moves = second % 2 == 1;
    for (int i = 0; i < 200; ++i) {
      const double part = moves ? std::sin(M_PI * i / 200.0) : 0.0;
      CHECK_FALSE(guard.repeats({t_ns += 5'000'000, {0.0, 0.0, part}, {part, 0.0, 9.81}}));
    }
  }
}
