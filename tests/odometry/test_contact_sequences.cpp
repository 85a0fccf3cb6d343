// Contact and impacts on simulated sequences: three in short, and a guard that keeps still where nothing strikes.
#include <doctest/doctest.h>

#include "filter/ingest/impact_guard.h"
#include "tests/support/contact_run.h"

using namespace ear;
using namespace ear::test;

namespace {

/// Samples of the accelerometer whose noise is raised, and of these how many are farther than 0.2 s from a touchdown.
struct Raised {
  int samples = 0;
  int wrong = 0;
};

Raised run_guard(const simulator::Simulation& simulation) {
  ImpactGuard guard(ImpactConfig{});
  const SampleSigma sigma(simulation.calibration().imu, 1.0 / simulation.calibration().imu.rate_hz);
  Raised raised;
  for (const ImuSample& sample : simulation.imu()) {
    const ImuNoiseFactors factors = guard.add(sample, sigma);
    if (factors.accel == 1.0 && factors.gyro == 1.0) continue;
    ++raised.samples;
    const double t = simulator::motion_time(sample.t_ns);
    const auto& touchdowns = simulation.plan().touchdowns;
    const bool landing = std::any_of(touchdowns.begin(), touchdowns.end(),
                                     [t](double touchdown) { return std::abs(t - touchdown) < 0.2; });
    raised.wrong += landing ? 0 : 1;
  }
  return raised;
}

}  // namespace

TEST_CASE("contact: flights, waves and lawn; impacts where the vehicle lands and nowhere else") {
  for (const char* name : {"fly1", "wave3", "lawn"}) {
    CAPTURE(name);
    const simulator::Simulation simulation = simulate_sensors(name, 901);
    const ContactRun run = run_contact(simulation);
    CHECK(run.wrong == 0);
    CHECK(run.missed == 0);
    CHECK(worst(run.takeoff_height) < 0.03);
    CHECK(worst(run.touchdown_delay) < 0.02);
    const Raised raised = run_guard(simulation);
    CHECK(raised.wrong == 0);
    const auto landings = static_cast<int>(simulation.plan().touchdowns.size());
    CHECK(raised.samples >= landings);
    CHECK(raised.samples <= 6 * landings);
  }
}
