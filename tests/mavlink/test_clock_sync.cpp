#include "src/mavlink/clock_sync.h"

#include <doctest/doctest.h>

#include <cmath>
#include <limits>
#include <random>

using namespace ear;
using namespace ear::mavlink;

namespace {

constexpr TimeNs kOffset = 123'456'789'000;  // other - ours, when ours is 0
constexpr double kDrift = 40e-6;

TimeNs remote(double t) { return kOffset + std::llround(1e9 * t * (1.0 + kDrift)); }

/// Ten exchanges a second from `begin` to `end` [s]; each way takes 1 ms and up to `jitter` more.
void exchange(ClockSync& sync, double begin, double end, double jitter, TimeNs step = 0) {
  std::mt19937_64 rng{7};
  std::exponential_distribution<double> delay(1.0);
  for (double t = begin; t < end; t += 0.1) {
    const double there = 1e-3 + jitter * delay(rng), back = 1e-3 + jitter * delay(rng);
    sync.add(std::llround(1e9 * t), remote(t + there) + step, std::llround(1e9 * (t + there + back)));
  }
}

double error_at(const ClockSync& sync, double t, TimeNs step = 0) {
  return seconds_between(std::llround(1e9 * t), sync.to_ours(remote(t) + step).value());
}

}  // namespace

TEST_CASE("clock synchronisation: nothing before enough answers, then within the jitter of the line") {
  ClockSync sync;
  CHECK_FALSE(sync.to_ours(remote(0.0)));
  exchange(sync, 0.0, 0.85, 0.5e-3);
  CHECK_FALSE(sync.ready());
  exchange(sync, 0.9, 2.0, 0.5e-3);
  REQUIRE(sync.ready());
  CHECK(std::abs(error_at(sync, 2.0)) < 0.5e-3);
}

TEST_CASE("clock synchronisation: follows the drift, through a line whose delays vary") {
  ClockSync sync;
  exchange(sync, 0.0, 300.0, 2e-3);
  CHECK(std::abs(error_at(sync, 300.0)) < 0.5e-3);
  CHECK(sync.steps() == 0);
  CHECK(std::abs(error_at(sync, 310.0)) < 0.7e-3);  // without answers it goes on
}

TEST_CASE("clock synchronisation: a restart of the other side is a step, a single wild answer is none") {
  ClockSync sync;
  exchange(sync, 0.0, 10.0, 0.0);
  sync.add(10'000'000'000, remote(10.0) + 1'000'000'000, 10'002'000'000);
  CHECK(sync.steps() == 0);
  CHECK(std::abs(error_at(sync, 10.0)) < 3e-4);
  const TimeNs step = -100'000'000'000;
  exchange(sync, 11.0, 14.0, 0.0, step);
  CHECK(sync.steps() == 1);
  CHECK(std::abs(error_at(sync, 14.0, step)) < 1e-4);
}

TEST_CASE("clock synchronisation: stamps that cannot be are passed over") {
  ClockSync sync;
  sync.add(5, 1, 0);                                    // answered before it was asked
  sync.add(0, 1, 1'000'000'000);                        // a second later
  sync.add(0, std::numeric_limits<TimeNs>::min(), 10);  // no time
  CHECK_FALSE(sync.ready());
  exchange(sync, 0.0, 2.0, 0.0);
  CHECK(sync.ready());
}
