// What becomes of samples that are late, early, false or missing, and in which order readings come out.
#include "filter/ingest/ingest.h"

#include <doctest/doctest.h>

#include <cmath>

#include <vector>

using namespace ear;

namespace {

constexpr TimeNs kMs = 1'000'000;

Calibration vehicle() {
  Calibration calibration;
  calibration.encoder.emplace();
  calibration.encoder->wraps = false;
  calibration.lasers.emplace();
  calibration.lasers->beams.resize(3);
  return calibration;
}

ImuSample sample(TimeNs t_ns, double rate = 0.0) { return {t_ns, {0.0, 0.0, rate}, {0.0, 0.0, 9.81}}; }

/// With inertial samples each 5 ms up to `until_ns`.
Ingest filled(TimeNs until_ns) {
  Ingest ingest(FilterConfig{}, vehicle());
  for (TimeNs t_ns = 0; t_ns <= until_ns; t_ns += 5 * kMs) {
    REQUIRE(ingest.judge(sample(t_ns), true).accepted);
    ingest.store(sample(t_ns));
  }
  return ingest;
}

void push(Ingest& ingest, TimeNs t_ns, std::int64_t count) {
  const Ingest::Encoders taken = ingest.take(EncoderSample{t_ns, count, count}, std::nullopt);
  REQUIRE(taken.verdict == Verdict::accepted);
  if (taken.increment) CHECK_FALSE(ingest.push(*taken.increment, true));
}

}  // namespace

TEST_CASE("ingest: readings come out in the order of their times, increments at their middle") {
  Ingest ingest = filled(100 * kMs);
  push(ingest, 0, 0);
  push(ingest, 10 * kMs, 100);
  push(ingest, 20 * kMs, 200);
  for (const TimeNs t_ns : {2 * kMs, 12 * kMs}) {
    CHECK_FALSE(ingest.push(BeamRanges(LaserSample{t_ns, {0.1, 0.2, 0.3}}, LaserCalibration{}), true));
  }
  std::vector<TimeNs> times;
  while (const auto next = ingest.next(18 * kMs)) {
    times.push_back(next->t_ns);
    CHECK(next->increment.has_value() == (next->t_ns % (5 * kMs) == 0));
  }
  CHECK(times == std::vector<TimeNs>{2 * kMs, 5 * kMs, 12 * kMs, 15 * kMs});
}

TEST_CASE("ingest: a reading that is not later than the one before, or far behind the state, is refused and counted") {
  Ingest ingest = filled(1000 * kMs);
  push(ingest, 500 * kMs, 0);
  CHECK(ingest.take({500 * kMs, 1, 1}, std::nullopt).verdict == Verdict::mistimed);
  CHECK(ingest.take({600 * kMs, 1, 1}, 800 * kMs).verdict == Verdict::mistimed);
  CHECK(ingest.judge(LaserSample{1600 * kMs, {0.1, 0.2, 0.3}}, std::nullopt) == Verdict::mistimed);
  const InputCounts counts = ingest.counts();
  CHECK(counts.encoder.not_later == 1);
  CHECK(counts.encoder.too_late == 1);
  CHECK(counts.laser.far_ahead == 1);
}

TEST_CASE("ingest: a gap leaves motion unseen, once, in proportion to how far the state has come") {
  Ingest ingest = filled(50 * kMs);
  CHECK(ingest.judge(sample(250 * kMs), true).unseen == doctest::Approx(0.2));
  ImuInterruption& gap = ingest.interruption();
  CHECK(gap.take_unseen(50 * kMs) == 0.0);
  CHECK_FALSE(gap.waits_for_images(50 * kMs));
  const double half = gap.take_unseen(150 * kMs);
  CHECK(half == doctest::Approx(0.1));
  CHECK(gap.waits_for_images(160 * kMs));
  const double rest = gap.take_unseen(300 * kMs);
  CHECK(std::hypot(half, rest) == doctest::Approx(0.2));  // variances add up to those of the whole
  CHECK(gap.take_unseen(400 * kMs) == 0.0);
  CHECK(gap.take_uncertain());
  CHECK_FALSE(gap.take_uncertain());
}

TEST_CASE("ingest: gaps that the state has not passed yet are all unseen; without a state, the last of them") {
  for (const bool has_state : {true, false}) {
    Ingest ingest = filled(50 * kMs);
    const auto gap_until = [&](TimeNs t_ns) {
      REQUIRE(ingest.judge(sample(t_ns), has_state).accepted);
      ingest.store(sample(t_ns));
    };
    gap_until(250 * kMs);
    gap_until(350 * kMs);
    CHECK(ingest.interruption().take_unseen(400 * kMs) == doctest::Approx(has_state ? 0.3 : 0.1));
  }

  Ingest ingest = filled(50 * kMs);
  for (TimeNs t_ns = 250 * kMs; t_ns <= 300 * kMs; t_ns += 10 * kMs) {
    REQUIRE(ingest.judge(sample(t_ns), true).accepted);
    ingest.store(sample(t_ns));
  }
  ImuInterruption& gap = ingest.interruption();
  const double first = gap.take_unseen(200 * kMs);  // three quarters of it
  REQUIRE(ingest.judge(sample(500 * kMs), true).accepted);
  CHECK(gap.take_unseen(201 * kMs) == 0.0);  // of both together as much is known already
  CHECK(std::hypot(first, gap.take_unseen(500 * kMs)) == doctest::Approx(0.4));
}

TEST_CASE("ingest: a restart forgets samples and readings, not the counts") {
  Ingest ingest = filled(50 * kMs);
  push(ingest, 10 * kMs, 0);
  push(ingest, 20 * kMs, 5);
  ingest.restart();
  CHECK(ingest.imu().empty());
  CHECK_FALSE(ingest.next(1000 * kMs));
  CHECK(ingest.increments().size() == 0);
  CHECK(ingest.counts().encoder.accepted == 2);
  CHECK(ingest.counts().imu.accepted == 11);
}

TEST_CASE("ingest: of readings that are dropped, passed ones too, nothing is left for another state") {
  Ingest ingest = filled(50 * kMs);
  for (int i = 0; i < 4; ++i) push(ingest, 10 * kMs * i, i);
  CHECK_FALSE(ingest.push(BeamRanges(LaserSample{20 * kMs, {0.1, 0.2, 0.3}}, LaserCalibration{}), true));
  REQUIRE(ingest.next(10 * kMs));
  REQUIRE(ingest.increments().size() == 3);
  ingest.drop_readings();
  CHECK(ingest.increments().size() == 0);
  CHECK_FALSE(ingest.next(1000 * kMs));
}

TEST_CASE("ingest: of a full queue the state has to pass the oldest first; without a state it makes room") {
  Ingest ingest = filled(10000 * kMs);
  WheelIncrement increment{0, 10 * kMs, {0.1, 0.1}};
  std::optional<TimeNs> due_ns;
  while (!due_ns) {
    due_ns = ingest.push(increment, true);
    increment = {increment.to_ns, increment.to_ns + 10 * kMs, increment.angle};
    REQUIRE(ingest.waiting_increments().size() < 10000);
  }
  CHECK(*due_ns == 10 * kMs);
  while (ingest.next(*due_ns)) continue;
  CHECK_FALSE(ingest.push(increment, false));
  CHECK(seconds_between(ingest.waiting_increments().front().from_ns, increment.to_ns) <= 2.0);
  CHECK(seconds_between(ingest.waiting_increments().front().from_ns, increment.to_ns) > 1.9);
}

TEST_CASE("ingest: a range out of its limits is no return") {
  LaserCalibration lasers;
  lasers.range_min = 0.05;
  lasers.range_max = 4.0;
  const BeamRanges ranges({5 * kMs, {0.04, 0.3, 65.535}}, lasers);
  CHECK(std::isnan(ranges.range[0]));
  CHECK(ranges.range[1] == 0.3);
  CHECK(std::isnan(ranges.range[2]));
  CHECK(ranges.t_ns == 5 * kMs);
}
