// Wheel readings that a driver stamps when they arrive: when they were taken.
#include "filter/ingest/even_clock.h"

#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <functional>
#include <random>
#include <vector>

using namespace ear;

namespace {

constexpr double kInterval = 0.025;        // [s]
constexpr double kCount = 2 * M_PI / 720;  // [rad], coarse, as on the robot that this is for

TimeNs nanoseconds(double seconds) { return static_cast<TimeNs>(std::llround(1e9 * seconds)); }

/// A reading: when it was taken, and when it arrived.
struct Reading {
  double taken = 0.0, arrived = 0.0;
};

/// How far the wheels have turned at a time [rad]: they speed up and slow down, differently in bends.
Eigen::Vector2d turned(double t) {
  const double mean = 6.0 * t - 4.0 * std::cos(0.9 * t);
  const double bend = 1.5 * std::sin(0.5 * t);
  return {mean - bend, mean + bend};
}

struct Result {
  double rms = 0.0, worst = 0.0;  ///< of what comes out against when readings were taken, after `from` [s]
  bool moved = false;             ///< a stamp that is not the one that went in
  bool even = false;              ///< at the end
};

Result run(const std::vector<Reading>& readings, double from) {
  EvenClock clock;
  Result result;
  double squares = 0.0, count = 0.0;
  TimeNs last_ns = 0;
  Eigen::Vector2d before = Eigen::Vector2d::Zero();
  for (std::size_t k = 0; k < readings.size(); ++k) {
    const Eigen::Vector2d now = (turned(readings[k].taken) / kCount).array().floor() * kCount;
    if (k > 0) {
      WheelIncrement increment{nanoseconds(readings[k - 1].arrived), nanoseconds(readings[k].arrived), now - before};
      clock.correct(increment);
      if (k > 1) CHECK(increment.from_ns == last_ns);
      CHECK(increment.to_ns > increment.from_ns);
      CHECK(increment.to_ns <= nanoseconds(readings[k].arrived));
      result.moved = result.moved || increment.to_ns != nanoseconds(readings[k].arrived);
      last_ns = increment.to_ns;
      if (readings[k].taken > from) {
        const double off = 1e-9 * static_cast<double>(increment.to_ns) - readings[k].taken;
        squares += off * off;
        count += 1.0;
        result.worst = std::max(result.worst, std::abs(off));
      }
    }
    before = now;
  }
  result.rms = std::sqrt(squares / count);
  result.even = clock.is_even();
  return result;
}

/// Taken at even intervals for 100 s. `delay`: of a reading taken at this time [s]; they arrive in order.
std::vector<Reading> arriving(const std::function<double(double)>& delay, double lost = 0.0) {
  std::mt19937 generator(5);
  std::vector<Reading> readings;
  double last = 0.0;
  for (int k = 1; k < 4000; ++k) {
    if (std::uniform_real_distribution<double>(0.0, 1.0)(generator) < lost) continue;
    const double taken = 10.0 + k * kInterval;
    last = std::max(last + 0.003, taken + delay(taken));  // a burst takes its time
    readings.push_back({taken, last});
  }
  return readings;
}

/// A bus that is busy, and a driver that now and then does not run: at 40 s for half a second, at 70 s for less and
/// less of the time, until its readings are 0.6 s late.
double held_up(double t) {
  static std::mt19937 generator(6);
  const double bus = std::exponential_distribution<double>(1.0 / 0.002)(generator);
  if (t > 40.0 && t < 40.5) return bus + 40.5 - t;
  if (t > 70.0 && t < 74.0) return bus + 0.15 * (t - 70.0);
  return bus;
}

}  // namespace

TEST_CASE("even clock: readings that come as they are taken stay as they are") {
  const Result result = run(arriving([](double) { return 0.0; }), 10.0);
  CHECK_FALSE(result.moved);
  CHECK_FALSE(result.even);
}

TEST_CASE("even clock: a driver that is held up; without the correction readings are up to 0.6 s late") {
  const std::vector<Reading> readings = arriving(held_up);
  double worst = 0.0;
  for (const Reading& r : readings) worst = std::max(worst, r.arrived - r.taken);
  REQUIRE(worst > 0.55);
  const Result result = run(readings, 35.0);
  CHECK(result.even);
  CHECK(result.rms < 0.002);
  CHECK(result.worst < 0.015);
}

TEST_CASE("even clock: readings that are lost on the way are no delay") {
  const Result result = run(arriving(held_up, 0.05), 35.0);
  CHECK(result.even);
  CHECK(result.rms < 0.010);
}

TEST_CASE("even clock: readings at uneven times, whose stamps are right, stay as they are") {
  std::mt19937 generator(7);
  std::vector<Reading> readings;
  for (double t = 10.0; t < 110.0;) {
    t += std::uniform_real_distribution<double>(0.01, 0.04)(generator);
    readings.push_back({t, t});
  }
  const Result result = run(readings, 10.0);
  CHECK_FALSE(result.moved);
  CHECK_FALSE(result.even);
}

TEST_CASE("even clock: where the intervals grow longer at once, stamps are believed after ten seconds") {
  std::mt19937 generator(8);
  std::vector<Reading> readings;
  double arrived = 0.0;
  for (double taken = 10.0; taken < 310.0; taken += taken < 210.0 ? kInterval : 1.08 * kInterval) {
    arrived = std::max(arrived + 1e-4, taken + std::normal_distribution<double>(0.0, 0.008)(generator));
    readings.push_back({taken, arrived});
  }
  CHECK(run(readings, 210.0).worst < 0.85);  // 8 % of ten seconds; learning the new interval meanwhile takes twice that
  CHECK(run(readings, 222.0).rms < 0.015);   // the stamps' own scatter is 0.008
}

TEST_CASE("even clock: a constant delay is not seen, one that ends is") {
  const Result result = run(arriving([](double t) { return held_up(0.0) + (t > 60.0 ? 0.08 : 0.0); }), 80.0);
  CHECK(result.even);
  CHECK(std::abs(result.rms - 0.08) < 0.005);  // for longer than a driver is held up: the way is longer now
}

TEST_CASE("even clock: begins anew after a gap") {
  EvenClock clock;
  WheelIncrement increment{0, nanoseconds(0.025), {0.1, 0.1}};
  clock.correct(increment);
  increment = {nanoseconds(3.0), nanoseconds(3.025), {0.1, 0.1}};
  clock.correct(increment);
  CHECK(increment.from_ns == nanoseconds(3.0));
  CHECK(increment.to_ns == nanoseconds(3.025));
}
