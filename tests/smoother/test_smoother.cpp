// The smoother as a whole: on simulated tracks, and where nothing can come of it.
#include "tests/smoother/support.h"

#include <cmath>
#include <limits>
#include <string>

#include "smoother/minimum.h"
#include "smoother/smoother.h"
#include "tests/support/simulated_run.h"
#include "tools/simulator/simulation.h"

using namespace ear;
using namespace ear::smoother;

namespace {

simulator::Simulation simulate(const char* sequence, double duration, const char* fault = nullptr) {
  simulator::Options options;
  if (fault) options.faults = {simulator::parse_fault(fault)};
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

TEST_CASE("smoother: health names a beam that is wrong, and no other sensor, while the estimate goes on") {
  const simulator::Simulation simulation = simulate("flat1", 11.0, "laser_biased.front_left@6+4=0.1");
  Smoother smoother(FilterConfig{}, simulation.calibration());
  std::size_t named = 0, others = 0;
  for (const ear::test::EvaluatedEstimate& e : ear::test::run_estimator(smoother, simulation)) {
    SourceSet faulty = e.estimate.health.faulty;
    if (faulty[index_of(Source::beam_0)]) ++named;
    faulty.reset(index_of(Source::beam_0));
    if (faulty.any()) ++others;
    CHECK(e.dp_W.norm() < 0.1);
  }
  CHECK(named > 60);
  CHECK(others == 0);
}

TEST_CASE("smoother: without images the wheels carry it, and health says so") {
  const simulator::Simulation simulation = simulate("flat1", 11.0, "camera_dropped@6+3");
  Smoother smoother(FilterConfig{}, simulation.calibration());
  double from = 1e9, to = 0.0;
  bool both_before = false;
  for (const ear::test::EvaluatedEstimate& e : ear::test::run_estimator(smoother, simulation)) {
    const Health& health = e.estimate.health;
    if (health.aiding == Aiding::wheels && health.status == HealthStatus::degraded) {
      from = std::min(from, e.t);
      to = std::max(to, e.t);
    }
    if (to == 0.0 && health.aiding == Aiding::cameras_and_wheels) both_before = true;
    CHECK(health.quality > 0);
  }
  CHECK(both_before);
  CHECK(from < 6.6);
  CHECK(to > 8.5);
  CHECK(smoother.health().status == HealthStatus::tracking);
}

TEST_CASE("smoother: after samples that were missing for long it begins anew where it was") {
  const simulator::Simulation simulation = simulate("flat1", 14.0, "imu_gap@6+2.5");
  Smoother smoother(FilterConfig{}, simulation.calibration());
  const std::vector<ear::test::EvaluatedEstimate> estimates = ear::test::run_estimator(smoother, simulation);
  REQUIRE_FALSE(estimates.empty());
  const ear::test::EvaluatedEstimate& last = estimates.back();
  CHECK(last.t > 13.0);
  CHECK(last.estimate.health.reset_counter == 1);
  const double sigma = std::sqrt(last.estimate.covariance.block<3, 3>(6, 6).trace());
  CHECK(last.dp_W.norm() < 3.0 * sigma);
  CHECK(sigma > 1.0);  // what it went meanwhile nobody knows
}

TEST_CASE("minimum: at the start the newest frame is known as well as was given") {
  std::mt19937_64 rng{8202};
  State x;
  x.odometer.wheel_radius = {0.075, 0.075};
  x.imu.p_WB = ear::test::random_vector(rng, 3.0);
  x.imu.v_W = ear::test::random_vector(rng, 1.0);
  const Eigen::VectorXd entries_of_A = ear::smoother::test::random_values(rng, err::clones * err::clones, 0.1);
  const Eigen::Map<const Eigen::MatrixXd> A(entries_of_A.data(), err::clones, err::clones);
  const Eigen::MatrixXd P = A * A.transpose() + 0.01 * Eigen::MatrixXd::Identity(err::clones, err::clones);
  const Window window(FilterConfig{}, 400.0, x, P);
  const std::optional<Eigen::MatrixXd> found = window.covariance();
  REQUIRE(found);
  const std::vector<int> entries = filter_entries();
  const Eigen::MatrixXd given = P(entries, entries);
  const Eigen::MatrixXd same = (*found)(entries, entries);
  CHECK(same.isApprox(given, 1e-5));
  CHECK((*found).row(err::normal).norm() == 0.0);
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
