#include <doctest/doctest.h>

#include <cmath>
#include <random>

#include "filter/ingest/beam_ranges.h"
#include "filter/sources/ground/beam_repeats.h"

using namespace ear;

namespace {

/// A range finder that reads in steps; 0: as fine as numbers are.
class RangeFinder {
 public:
  explicit RangeFinder(double step) : step_(step) {}

  double read(double range, double sigma) {
    const double noisy = range + sigma * normal_(rng_);
    return step_ > 0.0 ? step_ * std::round(noisy / step_) : noisy;
  }

 private:
  double step_;
  std::mt19937_64 rng_{71};
  std::normal_distribution<double> normal_;
};

/// [m] at 50 Hz: standing, rolling over a floor that is uneven, up by a metre and down again.
double drive_and_flight(int reading) {
  const double t = std::fmod(0.02 * reading, 60.0);
  if (t < 20.0) return 0.2037;
  if (t < 40.0) return 0.2037 + 0.003 * std::sin(5.0 * t);
  return 0.2037 + 0.5 * (1.0 - std::cos(M_PI * (t - 40.0) / 10.0));
}

/// How many of an hour's readings are called stuck, each range being given so often.
int called_stuck(double step, double sigma, int times = 1) {
  RangeFinder finder(step);
  BeamRepeats repeats;
  int stuck = 0;
  double range = 0.0;
  for (int i = 0; i < 180'000; ++i) {
    if (i % times == 0) range = finder.read(drive_and_flight(i), sigma);
    repeats.add(range);
    stuck += repeats.stuck() ? 1 : 0;
  }
  return stuck;
}

/// How many equal readings it takes, after half a minute of sound ones; 0: more than a hundred.
int readings_until_stuck(BeamRepeats& repeats, RangeFinder& finder, double sigma) {
  for (int i = 0; i < 1500; ++i) repeats.add(finder.read(drive_and_flight(i), sigma));
  REQUIRE_FALSE(repeats.stuck());
  const double range = finder.read(0.2, sigma);
  for (int i = 1; i <= 100; ++i) {
    repeats.add(range);
    if (repeats.stuck()) return i;
  }
  return 0;
}

}  // namespace

TEST_CASE("beam repeats: a sound beam is never stuck, whatever its steps and its noise") {
  for (const double step : {0.0, 0.001, 0.005, 0.01, 0.02}) {
    for (const double sigma : {0.0005, 0.001, 0.002, 0.004, 0.01}) {
      CAPTURE(step);
      CAPTURE(sigma);
      CHECK(called_stuck(step, sigma) == 0);
    }
  }
}

TEST_CASE("beam repeats: a beam that is asked more often than it measures is not stuck") {
  for (const int times : {2, 4, 5, 10}) {
    CAPTURE(times);
    CHECK(called_stuck(0.0, 0.004, times) == 0);
    CHECK(called_stuck(0.001, 0.004, times) == 0);
  }
}

TEST_CASE("beam repeats: where noise makes each reading another, five equal ones are no chance, the second time too") {
  RangeFinder finder(0.0);
  BeamRepeats repeats;
  CHECK(readings_until_stuck(repeats, finder, 0.004) == 5);
  CHECK(readings_until_stuck(repeats, finder, 0.004) == 5);
}

TEST_CASE(
    "beam repeats: with steps of a fraction of the noise it takes some more, with steps of the noise all may be "
    "chance") {
  RangeFinder fine(0.001), coarse(0.01);
  BeamRepeats of_fine, of_coarse;
  const int readings = readings_until_stuck(of_fine, fine, 0.004);
  CHECK(readings > 5);
  CHECK(readings < 20);
  CHECK(readings_until_stuck(of_coarse, coarse, 0.004) == 0);
}

TEST_CASE("beam repeats: one that never changed may be of coarse steps") {
  BeamRepeats repeats;
  for (int i = 0; i < 1000; ++i) repeats.add(0.2);
  CHECK_FALSE(repeats.stuck());
}

TEST_CASE("beam repeats: what a beam gives again is no new reading, unless it may be by chance") {
  RangeFinder fine(0.0), steps(0.001), coarse(0.01);
  BeamRepeats of_fine, of_steps, of_coarse;
  int repeats = 0;
  for (int i = 0; i < 1500; ++i) {
    of_fine.add(fine.read(drive_and_flight(i), 0.004));
    of_coarse.add(coarse.read(drive_and_flight(i), 0.004));
    of_steps.add(steps.read(drive_and_flight(i), 0.004));
    if (i < 500) continue;  // until it shows how often they repeat
    repeats += of_fine.repeats() || of_steps.repeats() || of_coarse.repeats() ? 1 : 0;
  }
  CHECK(repeats == 0);
  for (int i = 0; i < 200; ++i) {
    const double range = fine.read(0.2, 0.004);
    of_fine.add(range);
    CHECK_FALSE(of_fine.repeats());
    of_fine.add(range);
    repeats += of_fine.repeats() ? 1 : 0;
  }
  CHECK(repeats > 190);

  const BeamRanges reading(LaserSample{7, {0.2, 0.3, 0.4}}, LaserCalibration{}, std::bitset<kMaxBeams>("010"));
  CHECK(reading.range[0] == 0.2);
  CHECK(std::isnan(reading.range[1]));
  CHECK(reading.range[2] == 0.4);
}
