// Landings as they are, and with five times gravity, of which four get through: the error must not jump.
#include <doctest/doctest.h>

#include <algorithm>
#include <string>
#include <vector>

#include "tests/support/simulated_run.h"

using namespace ear;

namespace {

/// By how much the position's error grows from before a touchdown to two seconds after it; the worst landing [m].
double worst_growth(const simulator::Simulation& simulation) {
  Filter filter(FilterConfig{}, simulation.calibration());
  const std::vector<test::EvaluatedEstimate> estimates = test::run_filter(filter, simulation);
  double worst = 0.0;
  for (const double touchdown : simulation.plan().touchdowns) {
    const auto error_at = [&](double t) {
      const auto found = std::find_if(estimates.begin(), estimates.end(), [&](const test::EvaluatedEstimate& e) {
        return simulator::motion_time(e.estimate.state.t_ns) >= t;
      });
      REQUIRE(found != estimates.end());
      return found->dp_W;
    };
    const Eigen::Vector3d before = error_at(touchdown - 0.1);
    for (double after = 0.05; after <= 2.0; after += 0.05) {
      worst = std::max(worst, (error_at(touchdown + after) - before).norm());
    }
  }
  return worst;
}

/// Largest reading of one axis of the accelerometer [m/s^2].
double largest_force(const simulator::Simulation& simulation) {
  double largest = 0.0;
  for (const ImuSample& sample : simulation.imu()) largest = std::max(largest, sample.accel_B.cwiseAbs().maxCoeff());
  return largest;
}

}  // namespace

TEST_CASE("landing strike: the ordinary one, and 5 g clipped at 4 g, cost less than 5 cm") {
  for (const std::uint64_t seed : {831, 832}) {
    CAPTURE(seed);
    simulator::Options options;
    options.sequence = "fly1";
    options.seed = seed;
    const simulator::Simulation ordinary(options);
    REQUIRE(ordinary.plan().touchdowns.size() >= 2);
    CHECK(worst_growth(ordinary) < 0.05);
    for (const double touchdown : ordinary.plan().touchdowns) {
      options.faults.push_back(simulator::parse_fault("hard_landing@" + std::to_string(touchdown - 1.0) + "+2=5"));
    }
    const simulator::Simulation hard(options);
    CHECK(largest_force(hard) == doctest::Approx(4.0 * 9.81));
    CHECK(worst_growth(hard) < 0.05);
  }
}
