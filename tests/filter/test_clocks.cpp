// The clocks of the sensors: a jump of one of them is taken out, all else is left alone.
#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <optional>
#include <vector>

#include "filter/ingest/imu_clock.h"
#include "filter/ingest/stream_clock.h"

using namespace ear;

namespace {

constexpr TimeNs kMs = 1'000'000;
constexpr TimeNs kJumpAt = 2'000 * kMs;
constexpr TimeNs kBackAt = 4'000 * kMs;
constexpr TimeNs kEnd = 6'000 * kMs;

/// What a driver makes of a reading at this true time: its stamp; a negative one if there is no reading.
using Driver = std::function<TimeNs(TimeNs)>;

TimeNs sound(TimeNs t) { return t; }
bool amiss(TimeNs t) { return t >= kJumpAt && t < kBackAt; }

/// A stamp at which an inertial sample comes out, and the true time.
struct Out {
  TimeNs t = 0, stamp = 0;
};

/// Inertial samples each 5 ms, wheels each 10 ms a moment later, frames each 33 ms which come 12 ms later.
std::vector<Out> run(const Driver& imu, const Driver& wheels, const Driver& camera, bool with_wheels = true,
                     const std::function<void(const ImuClock&, const ImuSample&)>& look = {}) {
  ImuClock clock;
  std::vector<Out> out;
  std::vector<TimeNs> in;  // true times of samples handed in, which come out in this order
  std::size_t fetched = 0;
  const auto fetch = [&] {
    while (const auto sample = clock.next()) {
      if (look) look(clock, *sample);
      out.push_back({in[fetched++], sample->t_ns});
    }
  };
  for (TimeNs t = 0; t < kEnd; t += kMs) {
    if (t % (5 * kMs) == 0 && imu(t) >= 0) {
      ImuSample sample;
      sample.t_ns = imu(t);
      in.push_back(t);
      clock.add(sample);
      fetch();
    }
    if (with_wheels && t % (10 * kMs) == kMs && wheels(t - kMs) >= 0) {
      clock.observe(ImuClock::Stream::encoder, wheels(t - kMs));
      fetch();
    }
    const TimeNs exposed = t - 12 * kMs;
    if (exposed >= 0 && exposed % (33 * kMs) == 0 && camera(exposed) >= 0) {
      clock.observe(ImuClock::Stream::camera, camera(exposed));
      fetch();
    }
  }
  CHECK(fetched == in.size());
  return out;
}

/// The largest difference between stamps and true time [s].
double largest_error(const std::vector<Out>& out) {
  double largest = 0.0;
  for (const Out& o : out) largest = std::max(largest, std::abs(seconds_between(o.t, o.stamp)));
  return largest;
}

}  // namespace

TEST_CASE("imu clock: without jumps each sample comes out at once, as it is") {
  CHECK(largest_error(run(sound, sound, sound)) == 0.0);
  CHECK(largest_error(run(
            sound, [](TimeNs) { return TimeNs{-1}; }, sound)) == 0.0);
}

TEST_CASE("imu clock: a jump of its own is taken out, ahead and back, also with cameras alone") {
  for (const bool wheels : {true, false}) {
    for (const TimeNs jump : {60 * kMs, 100 * kMs, -100 * kMs, 1500 * kMs, -1500 * kMs}) {
      CAPTURE(jump);
      CAPTURE(wheels);
      const Driver jumping = [jump](TimeNs t) { return amiss(t) ? t + jump : t; };
      if (!wheels && std::abs(jump) < 100 * kMs) continue;  // within two frames' intervals
      CHECK(largest_error(run(jumping, sound, sound, wheels)) < 1e-3);
    }
  }
}

TEST_CASE("imu clock: samples that are missing, and clocks that jump together, are no jump of its own") {
  const Driver gap = [](TimeNs t) { return t >= kJumpAt && t < kJumpAt + 300 * kMs ? TimeNs{-1} : t; };
  CHECK(largest_error(run(gap, sound, sound)) == 0.0);
  CHECK(largest_error(run(gap, gap, gap)) == 0.0);
  for (const TimeNs jump : {100 * kMs, -100 * kMs}) {
    const Driver jumping = [jump](TimeNs t) { return amiss(t) ? t + jump : t; };
    const std::vector<Out> out = run(jumping, jumping, jumping);
    for (const Out& o : out) CHECK(o.stamp == jumping(o.t));
  }
}

TEST_CASE("imu clock: readings that come meanwhile show that samples were lost, unless all clocks jumped") {
  struct Lost {
    TimeNs lasts = 0;
    bool jumps = false, wheels = true, found = false;
  };
  std::vector<Lost> cases;
  for (const TimeNs lasts : {50 * kMs, 100 * kMs, 300 * kMs}) {
    for (const bool wheels : {true, false}) {
      cases.push_back({lasts, true, wheels, false});
      const bool frames_show = lasts >= 100 * kMs;  // one comes each 33 ms
      if (wheels || frames_show) cases.push_back({lasts, false, wheels, true});
    }
  }
  for (const Lost& c : cases) {
    CAPTURE(c.lasts);
    CAPTURE(c.jumps);
    CAPTURE(c.wheels);
    const Driver jumping = [&c](TimeNs t) { return t < kJumpAt ? t : t + c.lasts; };
    const Driver lost = [&c](TimeNs t) { return t >= kJumpAt && t < kJumpAt + c.lasts ? TimeNs{-1} : t; };
    const Driver others = c.jumps ? jumping : Driver(sound);
    std::optional<bool> found;
    run(c.jumps ? jumping : lost, others, others, c.wheels, [&](const ImuClock& clock, const ImuSample& sample) {
      if (sample.t_ns >= kJumpAt + c.lasts && !found) found = clock.went_on_before(sample);
    });
    REQUIRE(found);
    CHECK(*found == c.found);
  }
}

TEST_CASE("imu clock: one false stamp is none, nor are the wheels' own jumps") {
  const Driver once = [](TimeNs t) { return t == kJumpAt ? t - 100 * kMs : t; };
  for (const Out& o : run(once, sound, sound)) CHECK(o.stamp == once(o.t));
  const Driver jumping = [](TimeNs t) { return amiss(t) ? t + 100 * kMs : t; };
  CHECK(largest_error(run(sound, jumping, sound)) == 0.0);
}

TEST_CASE("imu clock: a stamp that is no time, among samples that wait, changes no verdict") {
  for (const TimeNs no_time : {std::numeric_limits<TimeNs>::min(), std::numeric_limits<TimeNs>::max()}) {
    CAPTURE(no_time);
    ImuClock clock;
    ImuSample sample;
    int out = 0;
    const auto fetch = [&] {
      while (const auto next = clock.next()) ++out;
    };
    for (int i = 0; i < 1000; ++i) {
      sample.t_ns = i * 5 * kMs + (i >= 400 ? 200 * kMs : 0);
      clock.add(sample);
      if (i == 401) {
        REQUIRE(clock.waiting());
        sample.t_ns = no_time;
        clock.add(sample);
      }
      fetch();
      if (i % 2 == 0) clock.observe(ImuClock::Stream::encoder, i * 5 * kMs);
      fetch();
    }
    CHECK(clock.jumps_corrected() == 1);
    CHECK(out == 1001);
  }
}

TEST_CASE("imu clock: after a long gap the samples come out at once, and a jump is found") {
  ImuClock clock;
  ImuSample sample;
  int waited = 0;
  for (int i = 0; i < 1500; ++i) {
    const TimeNs t_ns = i * 5 * kMs + (i >= 400 ? 10'000 * kMs : 0);
    sample.t_ns = t_ns + (i >= 1000 ? 200 * kMs : 0);
    clock.add(sample);
    if (i < 1000 && clock.waiting()) ++waited;
    while (clock.next()) continue;
    if (i % 2 == 0) clock.observe(ImuClock::Stream::encoder, t_ns);
    while (clock.next()) continue;
  }
  CHECK(waited == 0);
  CHECK(clock.jumps_corrected() == 1);
}

TEST_CASE("imu clock: a verdict that later readings contradict is undone") {
  ImuClock clock;
  TimeNs newest = 0;
  const auto add = [&](TimeNs t) {
    ImuSample sample;
    sample.t_ns = t;
    clock.add(sample);
    while (const auto s = clock.next()) newest = s->t_ns;
  };
  const auto observe = [&](TimeNs t) {
    clock.observe(ImuClock::Stream::encoder, t);
    while (const auto s = clock.next()) newest = s->t_ns;
  };
  TimeNs t = 0;
  for (; t < kJumpAt; t += 5 * kMs) {
    add(t);
    if (t % (10 * kMs) == 0) observe(t);
  }
  // All stood still for 0.3 s: the inertial samples are lost, the wheels' were queued and come all at once.
  const TimeNs resumed = t + 300 * kMs;
  for (TimeNs late = 0; late < 4; ++late) {
    add(resumed + 5 * kMs * late);
    observe(t + 10 * kMs * late);
  }
  CHECK(clock.jumps_corrected() == 1);
  CHECK(clock.take_correction());
  for (TimeNs queued = t + 40 * kMs; queued < resumed; queued += 10 * kMs) observe(queued);
  for (TimeNs now = resumed + 20 * kMs; now < resumed + 500 * kMs; now += 5 * kMs) {
    add(now);
    observe(now);
    if (now > resumed + 200 * kMs) CHECK(newest == now);
  }
  CHECK(clock.jumps_corrected() == 0);
  CHECK_FALSE(clock.take_correction());  // no sensor was at fault
}

TEST_CASE("imu clock: another jump that turns out to be none does not change what is undone of the first") {
  ImuClock clock;
  TimeNs newest = 0;
  const auto fetch = [&] {
    while (const auto s = clock.next()) newest = s->t_ns;
  };
  const auto add = [&](TimeNs t) {
    ImuSample sample;
    sample.t_ns = t;
    clock.add(sample);
    fetch();
  };
  const auto observe = [&](TimeNs t) {
    clock.observe(ImuClock::Stream::encoder, t);
    fetch();
  };
  TimeNs t = 0;
  for (; t < kJumpAt; t += 5 * kMs) {
    add(t);
    observe(t);
  }
  const TimeNs jump = 300 * kMs;  // of all, as it turns out
  for (int i = 0; i < 4; ++i, t += 5 * kMs) {
    add(t + jump);
    observe(t);
  }
  REQUIRE(clock.jumps_corrected() == 1);
  add(t + jump - 100 * kMs);  // a false stamp
  CHECK(clock.waiting());
  for (t += 5 * kMs; t < kJumpAt + 500 * kMs; t += 5 * kMs) {
    add(t + jump);
    observe(t + jump);
  }
  CHECK(clock.jumps_corrected() == 0);
  CHECK(newest == t - 5 * kMs + jump);
}

namespace {

/// What comes out of a stream's clock: camera frames each 33 ms, 12 ms after their exposure, or as `delay` says.
std::vector<Out> run_stream(const Driver& driver, const std::function<TimeNs(TimeNs)>& delay = {},
                            const std::function<bool(TimeNs)>& time_is_known = {}, int* jumps = nullptr) {
  StreamClock clock;
  std::vector<Out> out;
  for (TimeNs t = 0; t < kEnd; t += 33 * kMs) {
    if (driver(t) < 0) continue;
    const TimeNs arrival = t + (delay ? delay(t) : 12 * kMs);
    const bool known = !time_is_known || time_is_known(t);
    const auto stamp = clock.correct(driver(t), known ? std::optional(arrival / (5 * kMs) * (5 * kMs)) : std::nullopt);
    if (stamp) out.push_back({t, *stamp});
  }
  if (jumps != nullptr) *jumps = clock.jumps();
  return out;
}

}  // namespace

TEST_CASE("stream clock: a jump is taken out, but for the first reading after it") {
  for (const TimeNs jump : {60 * kMs, 100 * kMs, -100 * kMs, 1000 * kMs, -1000 * kMs}) {
    CAPTURE(jump);
    const Driver jumping = [jump](TimeNs t) { return amiss(t) ? t + jump : t; };
    const std::vector<Out> out = run_stream(jumping);
    CHECK(largest_error(out) < 1e-3);
    CHECK(out.size() == run_stream(sound).size() - 2);
  }
}

TEST_CASE("stream clock: late, missing and repeated readings are left alone") {
  const auto late = [](TimeNs t) { return amiss(t) ? 212 * kMs : 12 * kMs; };
  CHECK(largest_error(run_stream(sound, late)) == 0.0);
  CHECK(run_stream(sound, late).size() == run_stream(sound).size());
  const Driver gap = [](TimeNs t) { return t >= kJumpAt && t < kJumpAt + 300 * kMs ? TimeNs{-1} : t; };
  CHECK(largest_error(run_stream(gap)) == 0.0);
  const Driver every_other = [](TimeNs t) { return amiss(t) && t % (66 * kMs) != 0 ? TimeNs{-1} : t; };
  CHECK(largest_error(run_stream(every_other)) == 0.0);
  CHECK(largest_error(run_stream(every_other, late)) == 0.0);
}

TEST_CASE("stream clock: inertial samples that are slower than the readings give the time in steps, and no jump") {
  for (const TimeNs interval : {20 * kMs, 64 * kMs, 100 * kMs}) {
    CAPTURE(interval);
    StreamClock clock;
    for (TimeNs t = 0; t < kEnd; t += 16 * kMs) {
      const TimeNs now = t / interval * interval;
      CHECK(clock.correct(t, now, 1e-9 * static_cast<double>(interval)) == t);
    }
    CHECK(clock.jumps() == 0);
  }
}

TEST_CASE("stream clock: what looked like a jump while the process stood still is put back") {
  constexpr TimeNs resumed = kJumpAt + 600 * kMs;
  const Driver stalled = [](TimeNs t) { return t >= kJumpAt && t < resumed ? TimeNs{-1} : t; };
  // The first frames are read before the inertial samples that were queued with them.
  const auto delay = [](TimeNs t) {
    return t >= resumed && t < resumed + 100 * kMs ? kJumpAt - t + 12 * kMs : 12 * kMs;
  };
  int jumps = -1;
  const std::vector<Out> out = run_stream(stalled, delay, {}, &jumps);
  REQUIRE(!out.empty());
  bool taken_out = false;
  for (const Out& o : out) {
    if (o.t >= resumed && o.t < resumed + 100 * kMs) taken_out = taken_out || o.stamp != o.t;
    if (o.t > resumed + 500 * kMs) CHECK(o.stamp == o.t);
  }
  CHECK(taken_out);  // or it tests nothing
  CHECK(jumps == 0);
  CHECK(out.back().t > kEnd - 100 * kMs);
}

TEST_CASE("stream clock: one false stamp is left out, and clocks that jump together are left alone") {
  const Driver once = [](TimeNs t) { return t == 2013 * kMs ? t + 200 * kMs : t; };
  const std::vector<Out> out = run_stream(once);
  CHECK(largest_error(out) == 0.0);
  CHECK(out.size() == run_stream(sound).size() - 1);

  const Driver jumping = [](TimeNs t) { return amiss(t) ? t + 100 * kMs : t; };
  const auto with_all = [](TimeNs t) { return (amiss(t) ? 100 * kMs : 0) + 12 * kMs; };
  for (const Out& o : run_stream(jumping, with_all)) CHECK(o.stamp == jumping(o.t));
}

TEST_CASE("stream clock: stamps that are no times go through as they are, and change nothing") {
  StreamClock clock;
  for (int i = 0; i < 400; ++i) {
    const TimeNs now_ns = i * 10 * kMs;
    const TimeNs jump = i >= 200 ? 200 * kMs : 0;  // taken out: a shift to subtract
    if (i % 50 == 7) {
      CHECK(clock.correct(std::numeric_limits<TimeNs>::min(), now_ns) == std::numeric_limits<TimeNs>::min());
      CHECK(clock.correct(std::numeric_limits<TimeNs>::max(), now_ns) == std::numeric_limits<TimeNs>::max());
    }
    const std::optional<TimeNs> stamp = clock.correct(now_ns + jump, now_ns);
    if (i != 200) CHECK(stamp == now_ns);
  }
  CHECK(clock.jumps() == 1);
}

TEST_CASE("stream clock: while nobody knows the time it changes nothing") {
  const Driver jumping = [](TimeNs t) { return amiss(t) ? t + 100 * kMs : t; };
  const auto unknown = [](TimeNs t) { return t < kJumpAt - 100 * kMs || t > kJumpAt + 100 * kMs; };
  for (const Out& o : run_stream(jumping, {}, unknown)) {
    if (o.t < kBackAt) CHECK(o.stamp == jumping(o.t));
  }
}

TEST_CASE("stream clock: where the inertial samples stood still, the readings did not jump") {
  for (const TimeNs gap : {50 * kMs, 100 * kMs}) {
    StreamClock clock;
    for (int i = 0; i < 200; ++i) {
      const TimeNs t = i * 33 * kMs;
      // The last sample is from before the gap: time seems to go on in steps of its length.
      const bool gappy = i > 50;
      const TimeNs tick = gappy ? gap : 5 * kMs;
      const TimeNs now = (t + 12 * kMs) / tick * tick;
      CAPTURE(i);
      CHECK(clock.correct(t, now, 1e-9 * static_cast<double>(tick)).has_value());
    }
    CHECK(clock.jumps() == 0);
  }
}

TEST_CASE("stream clock: of a jump there and back nothing is left, whatever the phase of the inertial samples") {
  for (const TimeNs interval : {9'900'000, 10'000'000, 10'100'000}) {
    for (const TimeNs phase : {0 * kMs, 1 * kMs, 4 * kMs}) {
      CAPTURE(interval);
      CAPTURE(phase);
      StreamClock clock;
      double largest = 0.0;
      for (TimeNs t = 0; t < kEnd; t += interval) {
        const TimeNs now = (t + phase) / (5 * kMs) * (5 * kMs);
        const auto stamp = clock.correct(amiss(t) ? t + 100 * kMs : t, now, 0.005);
        if (stamp) largest = std::max(largest, std::abs(seconds_between(t, *stamp)));
      }
      CHECK(largest < 1e-3);
      CHECK(clock.jumps() == 2);
    }
  }
}
