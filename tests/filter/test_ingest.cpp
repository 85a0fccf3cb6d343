// What becomes of samples that are late, early, false or missing, and in which order readings come out.
#include "filter/ingest/ingest.h"

#include <doctest/doctest.h>

#include <cmath>
#include <cstddef>
#include <vector>

#include "filter/ingest/ring.h"

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

ImuVerdict add(Ingest& ingest, const ImuSample& sample, bool has_state) {
  const ImuVerdict verdict = ingest.judge(sample, has_state);
  REQUIRE(verdict.accepted);
  ingest.store(sample, verdict);
  return verdict;
}

/// With inertial samples each 5 ms up to `until_ns`.
Ingest filled(TimeNs until_ns) {
  Ingest ingest(FilterConfig{}, vehicle());
  for (TimeNs t_ns = 0; t_ns <= until_ns; t_ns += 5 * kMs) {
    add(ingest, sample(t_ns), true);
  }
  return ingest;
}

void push(Ingest& ingest, TimeNs t_ns, std::int64_t count) {
  const Ingest::Encoders taken = ingest.take(EncoderSample{t_ns, count, count}, std::nullopt);
  REQUIRE(taken.verdict == Verdict::accepted);
  if (taken.increment) CHECK_FALSE(ingest.push(*taken.increment, true));
}

}  // namespace

TEST_CASE("ring: keeps the oldest and every other one after that, in order, wherever it begins") {
  for (const int passed : {0, 3}) {
    CAPTURE(passed);
    for (const int count : {0, 1, 4, 5}) {
      CAPTURE(count);
      Ring<int> ring(5);
      for (int i = 0; i < passed; ++i) {
        ring.push(i);
        ring.pop();
      }
      for (int i = 0; i < count; ++i) ring.push(i);
      ring.keep_every_other();
      REQUIRE(ring.size() == static_cast<std::size_t>((count + 1) / 2));
      for (std::size_t i = 0; i < ring.size(); ++i) CHECK(ring[i] == static_cast<int>(2 * i));
    }
  }
}

TEST_CASE("ingest: readings come out in the order of their times, increments at their middle") {
  Ingest ingest = filled(100 * kMs);
  push(ingest, 0, 0);
  push(ingest, 10 * kMs, 100);
  push(ingest, 20 * kMs, 200);
  for (const TimeNs t_ns : {2 * kMs, 12 * kMs}) {
    CHECK_FALSE(ingest.push(BeamRanges(LaserSample{t_ns, {0.1, 0.2, 0.3}}, LaserCalibration{}), true));
  }
  std::vector<TimeNs> times;
  while (const auto next = ingest.next(18 * kMs, 0.0)) {
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

TEST_CASE("ingest: how long a gap took is unseen, once, in proportion to how far the state has come") {
  Ingest ingest = filled(50 * kMs);
  CHECK(ingest.judge(sample(250 * kMs), true).unseen == doctest::Approx(0.2));
  ImuInterruption& gap = ingest.interruption();
  CHECK(gap.take_unseen(50 * kMs).time == 0.0);
  CHECK_FALSE(gap.waits_for_images(50 * kMs));
  const double half = gap.take_unseen(150 * kMs).time;
  CHECK(half == doctest::Approx(0.1));
  CHECK(gap.waits_for_images(160 * kMs));
  const double rest = gap.take_unseen(300 * kMs).time;
  CHECK(std::hypot(half, rest) == doctest::Approx(0.2));  // variances add up to those of the whole
  CHECK(gap.take_unseen(400 * kMs).time == 0.0);
  CHECK(gap.take_uncertain());
  CHECK_FALSE(gap.take_uncertain());
}

TEST_CASE("ingest: gaps that the state has not passed yet are all unseen; without a state, the last of them") {
  for (const bool has_state : {true, false}) {
    Ingest ingest = filled(50 * kMs);
    const auto gap_until = [&](TimeNs t_ns) { add(ingest, sample(t_ns), has_state); };
    gap_until(250 * kMs);
    gap_until(350 * kMs);
    CHECK(ingest.interruption().take_unseen(400 * kMs).time == doctest::Approx(has_state ? 0.3 : 0.1));
  }

  Ingest ingest = filled(50 * kMs);
  for (TimeNs t_ns = 250 * kMs; t_ns <= 300 * kMs; t_ns += 10 * kMs) add(ingest, sample(t_ns), true);
  ImuInterruption& gap = ingest.interruption();
  const double first = gap.take_unseen(200 * kMs).time;  // three quarters of it
  REQUIRE(ingest.judge(sample(500 * kMs), true).accepted);
  CHECK(gap.take_unseen(201 * kMs).time == 0.0);  // of both together as much is known already
  CHECK(std::hypot(first, gap.take_unseen(500 * kMs).time) == doctest::Approx(0.4));
}

TEST_CASE("ingest: where other sensors went on in a gap, its time is known; the images are asked all the same") {
  Ingest ingest = filled(50 * kMs);
  for (const TimeNs t_ns : {10, 20, 30, 40, 50, 60, 70, 80, 90, 100}) {
    ingest.imu_clock().observe(ImuClock::Stream::encoder, t_ns * kMs);
    if (t_ns > 50) continue;
    ingest.imu_clock().add(sample(t_ns * kMs));
    while (ingest.imu_clock().next()) continue;
  }
  ingest.imu_clock().add(sample(105 * kMs));
  const std::optional<ImuSample> after = ingest.imu_clock().next();
  REQUIRE(after);
  CHECK(ingest.judge(*after, true).lost == 10);
  CHECK(ingest.interruption().take_unseen(105 * kMs).time == 0.0);
  CHECK(ingest.interruption().take_uncertain());
}

TEST_CASE("ingest: of samples that are refused, nothing was measured") {
  Ingest ingest = filled(300 * kMs);
  for (TimeNs t_ns = 100 * kMs; t_ns <= 300 * kMs; t_ns += 5 * kMs) {  // the clock was set back
    CHECK_FALSE(ingest.judge(sample(t_ns), true).accepted);
  }
  add(ingest, sample(305 * kMs), true);
  const ImuInterruption::Unseen unseen = ingest.interruption().take_unseen(305 * kMs);
  CHECK(unseen.time == doctest::Approx(0.2));
  CHECK(unseen.unmeasured == unseen.time);
}

TEST_CASE("ingest: samples are lost by what is usual, not by the rate that the calibration states") {
  for (const TimeNs interval_ns : {5 * kMs, 20 * kMs, 62 * kMs}) {
    CAPTURE(interval_ns);
    Ingest ingest(FilterConfig{}, vehicle());  // 200 Hz
    TimeNs t_ns = 0;
    for (int i = 0; i < 300; ++i, t_ns += interval_ns) add(ingest, sample(t_ns), true);
    for (int i = 0; i < 100; ++i, t_ns += interval_ns) {
      if (i % 4 == 3) t_ns += 2 * interval_ns;  // a third of all samples
      CHECK(add(ingest, sample(t_ns), true).lost == (i % 4 == 3 ? 2 : 0));
    }
    const ImuVerdict late = add(ingest, sample(t_ns + 3 * interval_ns), true);
    CHECK(late.lost >= 3);
    CHECK(late.gap == (4 * interval_ns > 120 * kMs));
  }
}

TEST_CASE("ingest: readings of wheels up to half a second apart are one increment; of counts that wrap, a quarter") {
  for (const bool wraps : {false, true}) {
    CAPTURE(wraps);
    Calibration calibration = vehicle();
    calibration.encoder->wraps = wraps;
    Ingest ingest(FilterConfig{}, calibration);
    TimeNs t_ns = 0;
    const auto increment_after = [&](TimeNs interval_ns) {
      t_ns += interval_ns;
      return ingest.take({t_ns, 0, 0}, std::nullopt).increment.has_value();
    };
    CHECK_FALSE(increment_after(0));
    CHECK(increment_after(240 * kMs));
    CHECK(increment_after(400 * kMs) == !wraps);
    CHECK_FALSE(increment_after(600 * kMs));
    CHECK(increment_after(10 * kMs));
  }
}

TEST_CASE("ingest: a restart forgets samples and readings, not the counts") {
  Ingest ingest = filled(50 * kMs);
  push(ingest, 10 * kMs, 0);
  push(ingest, 20 * kMs, 5);
  ingest.restart();
  CHECK(ingest.imu().empty());
  CHECK_FALSE(ingest.next(1000 * kMs, 0.0));
  CHECK(ingest.increments().size() == 0);
  CHECK(ingest.counts().encoder.accepted == 2);
  CHECK(ingest.counts().imu.accepted == 11);
}

TEST_CASE("ingest: of readings that are dropped, passed ones too, nothing is left for another state") {
  Ingest ingest = filled(50 * kMs);
  for (int i = 0; i < 4; ++i) push(ingest, 10 * kMs * i, i);
  CHECK_FALSE(ingest.push(BeamRanges(LaserSample{20 * kMs, {0.1, 0.2, 0.3}}, LaserCalibration{}), true));
  REQUIRE(ingest.next(10 * kMs, 0.0));
  REQUIRE(ingest.increments().size() == 3);
  ingest.drop_readings();
  CHECK(ingest.increments().size() == 0);
  CHECK_FALSE(ingest.next(1000 * kMs, 0.0));
}

TEST_CASE("ingest: readings come at their stamps plus the encoders' offset, in the order that these then have") {
  for (const double offset : {0.012, -0.012}) {
    CAPTURE(offset);
    Ingest ingest = filled(50 * kMs);
    for (int i = 0; i < 3; ++i) push(ingest, 10 * kMs * i, i);  // middles at 5 and 15 ms
    CHECK_FALSE(ingest.push(BeamRanges(LaserSample{8 * kMs, {0.1, 0.2, 0.3}}, LaserCalibration{}), true));
    std::vector<TimeNs> wheels;
    for (int i = 0; i < 3; ++i) {
      const std::optional<Measurement> next = ingest.next(50 * kMs, offset);
      REQUIRE(next);
      CHECK(next->increment.has_value() != (i == (offset > 0.0 ? 0 : 2)));
      if (!next->increment) continue;
      CHECK(next->t_ns == later_by(offset, middle_of(*next->increment)));
      wheels.push_back(next->t_ns);
    }
    const TimeNs moved = later_by(offset, TimeNs{0});
    CHECK(wheels == std::vector<TimeNs>{5 * kMs + moved, 15 * kMs + moved});
    CHECK(ingest.increments().size() == 1);  // as stamped
    CHECK(ingest.increments()[0].to_ns == 20 * kMs);
  }
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
  while (ingest.next(*due_ns, 0.0)) continue;
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
