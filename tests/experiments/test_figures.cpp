#include <doctest/doctest.h>

#include "tests/support/about.h"
#include "tools/experiments/figures.h"

namespace ear::experiments {
namespace {

using test::about;

simulator::Simulation simulate(double duration) {
  simulator::Options options;
  options.seed = 8301;
  options.duration = duration;
  return simulator::Simulation(options);
}

TEST_CASE("figures: of a short drive") {
  const simulator::Simulation simulation = simulate(12.0);
  const Figures figures =
      measure(simulation, simulation.true_calibration(), FilterConfig{}, evaluation::AlignmentKind::yaw);
  REQUIRE(figures.ate_rmse);
  CHECK(*figures.ate_rmse > 1e-5);
  CHECK(*figures.ate_rmse < 0.05);
  CHECK(*figures.length == about(simulation.path_length(), 0.02));
  CHECK(*figures.ate_percent == doctest::Approx(100.0 * *figures.ate_rmse / *figures.length));
  CHECK(*figures.z_rmse_ground == doctest::Approx(*figures.z_rmse));  // flat1 never flies
  CHECK(*figures.coverage > 90.0);
  CHECK(*figures.coverage < 100.0);  // it starts after half a second of standing
  CHECK(*figures.nees_position > 0.0);
  CHECK(*figures.sigma_position > 1e-4);
}

TEST_CASE("figures: who is told the true lenses sees features where they are, whatever the recording states") {
  simulator::Options options;
  options.seed = 8301;
  options.duration = 12.0;
  options.calibration_error = 5.0;
  const simulator::Simulation simulation(options);
  Calibration told = simulation.true_calibration();
  told.imu.accel_bias_sigma = 0.4;  // as large as it is drawn
  const Figures truth = measure(simulation, told, FilterConfig{}, evaluation::AlignmentKind::yaw);
  told.cameras = simulation.calibration().cameras;
  const Figures wrong = measure(simulation, told, FilterConfig{}, evaluation::AlignmentKind::yaw);
  REQUIRE(truth.ate_rmse);
  REQUIRE(wrong.ate_rmse);
  MESSAGE(*truth.ate_rmse, " m and ", *wrong.ate_rmse, " m, NEES ", *truth.nees_position, " and ",
          *wrong.nees_position);
  CHECK(*truth.ate_rmse < 0.8 * *wrong.ate_rmse);
  CHECK(*truth.nees_position < 4.0);  // 1.7, and 82 for who is told wrong lenses
  CHECK(*wrong.nees_position > 20.0);
  CHECK(*truth.nees_orientation < 6.0);
}

TEST_CASE("figures: a vehicle that never starts has coverage 0 and nothing else") {
  const simulator::Simulation simulation = simulate(0.3);
  const Figures figures = measure(simulation, simulation.calibration(), FilterConfig{}, evaluation::AlignmentKind::yaw);
  CHECK(figures.coverage == 0.0);
  CHECK_FALSE(figures.ate_rmse);
  CHECK_FALSE(figures.length);
}

}  // namespace
}  // namespace ear::experiments
