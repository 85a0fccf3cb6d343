// Sensors that lie, in whole runs on simulated feature tracks: they are named while they lie, and not otherwise.
#include <doctest/doctest.h>

#include <functional>
#include <string>

#include "tests/support/simulated_run.h"
#include "tools/experiments/figures.h"
#include "tools/simulator/faults.h"
#include "tools/simulator/simulation.h"

using namespace ear;

namespace {

constexpr TimeNs kMotionStart = 1'600'000'000'000'000'000;  // stamp at which the simulated motion begins

struct Alarms {
  double frames = 0.0;  ///< with three displacements
  std::array<double, kMotionSensors> named{};
  double disagree = 0.0;

  void add(const Consistency& c) {
    if (!c.available[0] || !c.available[1] || !c.available[2]) return;
    frames += 1.0;
    disagree += c.disagree() ? 1.0 : 0.0;
    if (c.anomalous) named[static_cast<std::size_t>(*c.anomalous)] += 1.0;
  }
};

simulator::Options options_of(const char* sequence, double duration, double rate_hz) {
  simulator::Options options;
  options.sequence = sequence;
  options.seed = 8201;
  options.duration = duration;
  options.camera_rate_hz = rate_hz;
  return options;
}

/// Alarms from `from` to `to`, in seconds of the motion.
Alarms alarms_of(const simulator::Options& options, const FilterConfig& config, double from, double to,
                 const std::function<void(FeatureFrame&)>& change = {}) {
  const simulator::Simulation simulation(options);
  Filter filter(config, simulation.calibration());
  Alarms alarms;
  for (const test::EvaluatedEstimate& e : test::run_filter(filter, simulation, change)) {
    const double t = seconds_between(kMotionStart, e.estimate.state.t_ns);
    if (t >= from && t < to) alarms.add(e.estimate.consistency);
  }
  return alarms;
}

/// A fault from 10 to 15 s.
Alarms alarms_during(const char* fault, const FilterConfig& config) {
  simulator::Options options = options_of("flat1", 16.0, 30.0);
  options.faults.push_back(simulator::parse_fault(std::string(fault) + "@10+5"));
  // An image that repeats the one before to the byte is none. A recording of it need not: it goes by what is seen.
  return alarms_of(options, config, 10.2, 15.0, [](FeatureFrame& frame) { frame.repeated = false; });
}

double share(double count, const Alarms& alarms) { return count / alarms.frames; }

}  // namespace

TEST_CASE("anomaly: sensors that are right are suspected no more than a few times as often as was asked") {
  FilterConfig config;
  config.anomaly.score = AnomalyScore::mahalanobis;
  config.anomaly.false_alarm = 0.01;
  for (const char* sequence : {"flat1", "wave1"}) {
    for (const double rate_hz : {30.0, 5.0}) {
      CAPTURE(sequence);
      CAPTURE(rate_hz);
      const Alarms alarms = alarms_of(options_of(sequence, 40.0, rate_hz), config, 0.0, 40.0);
      REQUIRE(alarms.frames > 30.0 * rate_hz);
      CHECK(share(alarms.disagree, alarms) < 0.05);
    }
  }
}

TEST_CASE("anomaly: wheels that slip, and a camera whose image freezes, are named while they do") {
  FilterConfig config;
  config.anomaly.score = AnomalyScore::mahalanobis;
  const Alarms slip = alarms_during("wheel_slipping", config);
  CHECK(share(slip.named[static_cast<std::size_t>(MotionSensor::odometer)], slip) > 0.9);
  const Alarms frozen = alarms_during("camera_frozen", config);
  CHECK(share(frozen.named[static_cast<std::size_t>(MotionSensor::camera)], frozen) > 0.9);
}

TEST_CASE("anomaly: a dark image is noisy, not wrong: the camera goes on to be compared, and is not named") {
  const Alarms dark = alarms_during("camera_dark", FilterConfig{});
  REQUIRE(dark.frames > 100.0);
  CHECK(share(dark.named[static_cast<std::size_t>(MotionSensor::camera)], dark) < 0.05);
}

// While their features passed a gate that the camera's weight had opened, they cost 2.2 times the error of this drive.
TEST_CASE("anomaly: people who walk before the vehicle do not lead it away") {
  simulator::Options options;
  options.sequence = "wave2";
  options.seed = 1424;
  options.calibration_error = 1.0;
  const auto error = [&options] {
    const simulator::Simulation simulation(options);
    return experiments::measure(simulation, simulation.calibration(), FilterConfig{}, evaluation::AlignmentKind::yaw)
        .ate_rmse.value_or(1.0);
  };
  const double alone = error();
  REQUIRE(alone < 0.05);
  options.faults.push_back(simulator::parse_fault("people@20+5"));
  CHECK(error() < 1.3 * alone);
}
