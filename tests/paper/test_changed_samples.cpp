#include <doctest/doctest.h>

#include <cmath>

#include "tools/paper/measure/changed_samples.h"

using namespace ear;
using namespace ear::paper;

TEST_CASE("changed samples: a body that sways on standing wheels turns the changed angles twice as far") {
  simulator::Options options;
  options.sequence = "sway1";
  options.duration = 12.0;
  options.sensor_noise = false;
  options.tracks = false;
  options.calibration_error = 0.0;
  const simulator::Simulation simulation(options);
  const WithoutPitch change(simulation, simulation.calibration());
  const auto resolution = simulation.calibration().encoder->resolution;
  const auto turn = [&](std::int64_t from, std::int64_t to) {  // the short way round
    return std::remainder(static_cast<double>(to - from), static_cast<double>(resolution));
  };
  const EncoderSample& first = simulation.encoders().front();
  double largest = 0.0;
  for (const EncoderSample& sample : simulation.encoders()) {
    const double as_it_is = turn(first.left_count, sample.left_count);
    const double changed = turn(change(first).left_count, change(sample).left_count);
    largest = std::max(largest, std::abs(as_it_is));
    CHECK(std::abs(changed - 2.0 * as_it_is) < 0.02 * std::abs(as_it_is) + 60.0);
  }
  CHECK(largest > 1000.0);  // it did sway
}

TEST_CASE("changed samples: one beam without return takes the others along") {
  const LaserSample whole{5, {0.1, 0.2, 0.3}};
  CHECK(together(whole).range == whole.range);
  const LaserSample part = together({5, {0.1, std::nan(""), 0.3}});
  CHECK(part.t_ns == 5);
  for (const double range : part.range) CHECK(std::isnan(range));
}
