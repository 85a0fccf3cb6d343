// Cameras whose clock is further off than the calibration allows: it is learned, and frames wait by what was learned.
#include <doctest/doctest.h>

#include <cmath>
#include <cstddef>
#include <optional>
#include <string>

#include "src/queued_odometry.h"
#include "tools/experiments/figures.h"
#include "tools/simulator/film.h"

using namespace ear;
using namespace ear::experiments;

namespace {

constexpr TimeNs kSecond = 1'000'000'000;

double ate(const std::string& sequence, double believed) {
  simulator::Options options;
  options.sequence = sequence;
  options.seed = 831;
  options.duration = 35.0;
  const simulator::Simulation simulation(options);
  Calibration calibration = simulation.calibration();
  calibration.camera_time_offset = believed;
  const Figures figures = measure(simulation, calibration, FilterConfig{}, evaluation::AlignmentKind::yaw);
  CHECK(figures.false_tracking.value_or(100.0) < 0.1);
  return figures.ate_rmse.value_or(INFINITY);
}

}  // namespace

TEST_CASE("late images: stamps that are 40 or 80 ms late cost little") {
  for (const char* sequence : {"wave1", "fly1"}) {
    CAPTURE(sequence);
    const double clean = ate(sequence, 0.0);
    for (const double early : {-0.04, -0.08}) {  // what is believed: they are taken so long before their stamps
      CAPTURE(early);
      const double found = ate(sequence, early);
      CHECK(found < 1.5 * clean);
    }
  }
}

TEST_CASE("late images: where the inertial samples come later than the stamps say, frames wait for them") {
  constexpr TimeNs kOff = 50'000'000;  // [ns]
  simulator::Options options;
  options.sequence = "wave1";
  options.seed = 11;
  options.duration = 10.0;
  options.camera_rate_hz = 15.0;
  const simulator::Film drive(options);
  const simulator::Simulation& simulation = drive.simulation;
  QueuedOdometry odometry(Config{}, simulation.calibration(), QueueCapacity{});
  std::size_t frames = 0;
  std::optional<Estimate> estimate, last;
  for (const simulator::Delivery& delivery : simulation.deliveries()) {
    if (delivery.stream == simulator::SensorStream::encoder) {
      REQUIRE(odometry.add_encoder(simulation.encoders()[delivery.index]));
    } else if (delivery.stream == simulator::SensorStream::imu) {
      const ImuSample& sample = simulation.imu()[delivery.index];
      REQUIRE(odometry.add_imu(sample));
      while (frames < simulation.frame_times().size() && simulation.frame_times()[frames] - kOff <= sample.t_ns) {
        StereoFrame frame = drive.frame(frames++);
        frame.t_ns -= kOff;
        REQUIRE(odometry.add_stereo(frame));
      }
    } else {
      continue;
    }
    while (odometry.process(estimate) != Progress::no_frame) {
      if (estimate) last = estimate;
    }
  }
  CHECK(odometry.odometry().input_counts().camera.far_ahead < 3);
  const double learned = odometry.odometry().calibration().camera_time_offset;
  CHECK(std::abs(learned - 1e-9 * kOff) < 0.01);
  REQUIRE(last);
  CHECK(last->state.t_ns > simulation.frame_times().back() - kSecond / 4);
}
