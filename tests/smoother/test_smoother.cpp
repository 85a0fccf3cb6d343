// The smoother as a whole: on simulated tracks, and where nothing can come of it.
#include "tests/smoother/support.h"

#include <cmath>
#include <limits>
#include <string>

#include "smoother/smoother.h"
#include "tests/support/simulated_run.h"
#include "tools/simulator/simulation.h"

using namespace ear;
using namespace ear::smoother;

namespace {

simulator::Simulation simulate(const char* sequence, double duration) {
  simulator::Options options;
  options.sequence = sequence;
  options.seed = 8201;
  options.duration = duration;
  return simulator::Simulation(options);
}

struct Errors {
  std::size_t estimates = 0;
  double rmse = 0.0;     ///< of the position [m]
  double nees = 0.0;     ///< mean, of the position; 3 is consistent
  double largest = 0.0;  ///< [m]
};

Errors run(const simulator::Simulation& simulation, OdometerModel model = OdometerModel::terrain) {
  FilterConfig config;
  config.odometer.model = model;
  Smoother smoother(config, simulation.calibration());
  Errors errors;
  for (const ear::test::EvaluatedEstimate& e : ear::test::run_estimator(smoother, simulation)) {
    ++errors.estimates;
    errors.rmse += e.dp_W.squaredNorm();
    errors.largest = std::max(errors.largest, e.dp_W.norm());
    const Eigen::Matrix3d P = e.estimate.covariance.block<3, 3>(estimate_error::position, estimate_error::position);
    errors.nees += e.dp_W.dot(P.ldlt().solve(e.dp_W));
  }
  REQUIRE(errors.estimates > 0);
  errors.rmse = std::sqrt(errors.rmse / static_cast<double>(errors.estimates));
  errors.nees /= static_cast<double>(errors.estimates);
  return errors;
}

}  // namespace

TEST_CASE("smoother: drives on flat ground and over waves") {
  for (const char* sequence : {"flat1", "wave1"}) {
    CAPTURE(std::string(sequence));
    const Errors errors = run(simulate(sequence, 15.0));
    CHECK(errors.estimates > 400);
    CHECK(errors.rmse < 0.06);
    CHECK(errors.nees < 15.0);
  }
}

TEST_CASE("smoother: takes off, flies, and lands") {
  const Errors errors = run(simulate("fly1", 30.0));
  CHECK(errors.estimates > 820);
  CHECK(errors.rmse < 0.06);
  CHECK(errors.largest < 0.12);
}

TEST_CASE("smoother: without wheels, from cameras and inertial samples") {
  const Errors errors = run(simulate("flat1", 15.0), OdometerModel::none);
  CHECK(errors.rmse < 0.06);
}

TEST_CASE("smoother: a window of no numbers comes to nothing, and ends nothing") {
  State x;
  x.odometer.wheel_radius = {0.075, 0.075};
  x.imu.v_W.x() = std::numeric_limits<double>::quiet_NaN();
  const Eigen::MatrixXd P = 1e-4 * Eigen::MatrixXd::Identity(err::clones, err::clones);
  Window window(FilterConfig{}, 400.0, x, P);
  NewFrame next;
  next.t_ns = 33'000'000;
  for (int i = 0; i < 7; ++i) next.since.imu.add(Eigen::Vector3d::Zero(), {0.0, 0.0, 9.81}, 0.005, ImuCalibration{});
  window.add(next, {});
  CHECK_FALSE(window.optimize());
}

TEST_CASE("smoother: settings and vehicles that it does not know are named") {
  FilterConfig config;
  config.odometer.model = OdometerModel::gyro;
  const simulator::Simulation simulation = simulate("flat1", 1.0);
  CHECK_THROWS_AS(Smoother(config, simulation.calibration()), std::invalid_argument);
  Calibration blind = simulation.calibration();
  blind.cameras.clear();
  CHECK_THROWS_AS(Smoother(FilterConfig{}, blind), std::invalid_argument);
}
