// One record per sensor.
#include <doctest/doctest.h>

#include <limits>

#include "filter/ekf/source_log.h"

using namespace ear;

TEST_CASE("source log: a measurement is compared with its gate") {
  SourceLog log;
  log.add(Source::wheel_left, 0.2, 0.01, 9.0, 100);
  const SourceRecord& wheel = log.records()[index_of(Source::wheel_left)];
  CHECK(wheel.innovation == 0.2);
  CHECK(wheel.variance == 0.01);
  CHECK(wheel.gate_ratio == doctest::Approx(0.04 / 0.09));
  CHECK(wheel.used == 1);
  CHECK(wheel.rejected == 0);
  CHECK(wheel.last_used_ns == 100);
  log.add(Source::wheel_left, -0.4, 0.01, 9.0, 200);
  CHECK(wheel.gate_ratio > 1.0);
  CHECK(wheel.rejected == 1);
  CHECK(wheel.last_used_ns == 100);
  CHECK(log.records()[index_of(Source::wheel_right)].used == 0);
}

TEST_CASE("source log: what is no number does not fit") {
  SourceLog log;
  log.add(Source::beam_0, std::numeric_limits<double>::quiet_NaN(), 0.01, 9.0, 100);
  CHECK(log.records()[index_of(Source::beam_0)].rejected == 1);
  CHECK(log.records()[index_of(Source::beam_0)].used == 0);
}

TEST_CASE("source log: a new frame counts from zero, and remembers what was measured last") {
  SourceLog log;
  log.add(Source::beam_2, 0.01, 1e-4, 9.0, 100);
  log.add(Source::camera_left, {30, 2, 0.5, 0.36}, 9.0, 110);
  log.start_frame();
  const SourceRecord& beam = log.records()[index_of(Source::beam_2)];
  CHECK(beam.used == 0);
  CHECK(beam.innovation == 0.01);
  CHECK(beam.last_used_ns == 100);
  CHECK(log.records()[index_of(Source::camera_left)].rejected == 0);
  CHECK(log.records()[index_of(Source::camera_left)].innovation == 0.5);
}
