#include "filter/sources/wheels/reading_noise.h"

#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <random>

#include "tests/support/about.h"

using namespace ear;
using ear::test::about;

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
