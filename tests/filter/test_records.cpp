// One record per sensor.
#include <doctest/doctest.h>

#include <limits>

#include "filter/ekf/records.h"

using namespace ear;

namespace {

constexpr double kGate = 9.0;

Innovation innovation(double value) { return {value, 0.01, kGate, value * value <= kGate * 0.01}; }

}  // namespace

TEST_CASE("records: a measurement is compared with its gate") {
  InnovationLog log;
  log.add(Source::wheel_left, innovation(0.2), 100);
  const SourceRecord& wheel = log.records()[index_of(Source::wheel_left)];
  CHECK(wheel.innovation == 0.2);
  CHECK(wheel.variance == 0.01);
  CHECK(wheel.gate_ratio == doctest::Approx(0.04 / 0.09));
  CHECK(wheel.used == 1);
  CHECK(wheel.rejected == 0);
  CHECK(wheel.last_used_ns == 100);
  log.add(Source::wheel_left, innovation(-0.4), 200);
  CHECK(wheel.gate_ratio > 1.0);
  CHECK(wheel.rejected == 1);
  CHECK(wheel.last_used_ns == 100);
  CHECK(log.records()[index_of(Source::wheel_right)].used == 0);
}

TEST_CASE("records: what is no number does not fit") {
  InnovationLog log;
  log.add(Source::beam_0, innovation(std::numeric_limits<double>::quiet_NaN()), 100);
  CHECK(log.records()[index_of(Source::beam_0)].rejected == 1);
  CHECK(log.records()[index_of(Source::beam_0)].used == 0);
}

TEST_CASE("records: a new frame counts from zero, and remembers what was measured last") {
  InnovationLog log;
  log.add(Source::beam_2, innovation(0.01), 100);
  log.add(Source::camera_left, {0.5, 0.36, kGate}, 30, 2, 110);
  log.start_frame();
  const SourceRecord& beam = log.records()[index_of(Source::beam_2)];
  CHECK(beam.used == 0);
  CHECK(beam.innovation == 0.01);
  CHECK(beam.last_used_ns == 100);
  CHECK(log.records()[index_of(Source::camera_left)].rejected == 0);
  CHECK(log.records()[index_of(Source::camera_left)].innovation == 0.5);
}
