// The filter begins anew after it was lost, however the vehicle moves then: the pose goes on where it was last known,
// with a covariance that can be, and the reset counter tells.
#include <doctest/doctest.h>

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <optional>
#include <string>
#include <vector>

#include "filter/filter.h"
#include "tests/support/tapped_run.h"
#include "tests/support/true_start.h"

using namespace ear;
using namespace ear::test;

namespace {

constexpr TimeNs kHour = 3'600'000'000'000;
constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();

simulator::Simulation simulate(const std::string& sequence) {
  simulator::Options options;
  options.sequence = sequence;
  options.seed = 8402;
  options.duration = 14.0;
  return simulator::Simulation(options);
}

struct Step {
  double t = 0.0;  ///< [s]
  Health health;
  Status status = Status::waiting_for_imu;
  std::optional<Estimate> estimate;
};

std::vector<Step> run(const simulator::Simulation& simulation, const Taps& taps,
                      const std::function<void(double t, Filter& filter)>& after_step = {},
                      const std::optional<GivenStart>& start = {}) {
  Filter filter(FilterConfig{}, simulation.calibration());
  if (start) filter.start_at(*start);
  std::vector<Step> steps;
  run_tapped(simulation, filter, taps, [&](double t, const std::optional<Estimate>& estimate) {
    steps.push_back({t, filter.health(), filter.status(), estimate});
    if (after_step) after_step(t, filter);
  });
  return steps;
}

/// No sample of any stream between the two times.
Taps silence(double from, double to) {
  const auto hold_back = [=](double t, auto&) { return t > from && t < to ? 0 : 1; };
  return {hold_back, hold_back, hold_back, hold_back};
}

/// All clocks together are set back.
Taps set_back(double from) {
  const auto shift = [=](double t, auto& sample) {
    if (t > from) sample.t_ns -= kHour;
    return 1;
  };
  return {shift, shift, shift, shift};
}

bool positive(const Eigen::MatrixXd& P) {
  const Eigen::VectorXd scale = P.diagonal().cwiseMax(1e-30).cwiseSqrt().cwiseInverse();
  Eigen::MatrixXd correlation = scale.asDiagonal() * P * scale.asDiagonal();
  correlation.diagonal().array() += 1e-6;
  return P.allFinite() && P.diagonal().minCoeff() > 0.0 &&
         Eigen::LLT<Eigen::MatrixXd>(correlation).info() == Eigen::Success;
}

struct Restart {
  const Step* before = nullptr;  ///< the last estimate of the old world
  const Step* first = nullptr;   ///< the first one of the new world
};

/// Exactly one restart, with silence in between and nothing that cannot be before or after.
Restart check_restart(const std::vector<Step>& steps) {
  Restart restart;
  for (const Step& step : steps) {
    CAPTURE(step.t);
    if (!step.estimate) continue;
    REQUIRE(step.estimate->state.p_WB.allFinite());
    REQUIRE(positive(step.estimate->covariance));
    if (step.health.reset_counter == 0) restart.before = &step;
    if (step.health.reset_counter == 1 && restart.first == nullptr) restart.first = &step;
  }
  REQUIRE(restart.before != nullptr);
  REQUIRE(restart.first != nullptr);
  CHECK(steps.back().estimate.has_value());
  CHECK(steps.back().health.reset_counter == 1);
  CHECK(steps.back().health.faulty.none());
  const Health& last = steps.back().health;
  CHECK((last.status == HealthStatus::tracking || last.imprecise));  // nothing shows again where it was
  const Step& waiting = *(restart.first - 1);
  CHECK(waiting.status == Status::lost);
  CHECK(waiting.health.status == HealthStatus::lost);
  return restart;
}

/// The distance between the last pose of the old world and the newest one, against the true one; at most three of the
/// standard deviations that the estimate itself gives. `clock_shift`: from the stamps at the end to true time [ns].
void check_continued(const simulator::Simulation& simulation, const Restart& restart, const Step& last,
                     TimeNs clock_shift = 0) {
  const NavState& from = restart.before->estimate->state;
  const NavState& to = last.estimate->state;
  const simulator::Truth true_from = simulation.truth(from.t_ns);
  const simulator::Truth true_to = simulation.truth(to.t_ns + clock_shift);
  const double off = std::abs((to.p_WB - from.p_WB).norm() - (true_to.p_WB - true_from.p_WB).norm());
  const Eigen::Matrix3d P = last.estimate->covariance.block<3, 3>(estimate_error::position, estimate_error::position);
  CAPTURE(restart.first->t);
  CHECK(off < 3.0 * std::sqrt(P.trace()));
  CHECK(std::abs(to.v_W.norm() - true_to.v_W.norm()) < 0.05);
}

}  // namespace

TEST_CASE("restart: standing, after inertial samples were missing for long") {
  const simulator::Simulation simulation = simulate("static");
  const std::vector<Step> steps = run(simulation, silence(5.0, 8.0));
  const Restart restart = check_restart(steps);
  check_continued(simulation, restart, steps.back());
  CHECK((restart.first->estimate->state.p_WB - restart.before->estimate->state.p_WB).norm() < 1e-2);
  CHECK(restart.first->t < 9.5);
}

TEST_CASE("restart: rolling, after inertial samples were missing for long") {
  const simulator::Simulation simulation = simulate("flat1");
  const std::vector<Step> steps = run(simulation, silence(6.0, 9.0));
  const Restart restart = check_restart(steps);
  check_continued(simulation, restart, steps.back());
  CHECK(restart.first->t < 11.5);
}

TEST_CASE("restart: the window stays as small as it was set") {
  constexpr int clones = 4;
  const std::vector<Step> steps = run(simulate("flat1"), silence(6.0, 9.0), [&](double t, Filter& filter) {
    if (t < 1.0) filter.set_window(clones);
  });
  int most = 0;
  for (const Step& step : steps) {
    if (step.estimate && step.health.reset_counter == 1) most = std::max(most, step.estimate->frame.clones);
  }
  CHECK(most == clones);
}

TEST_CASE("restart: rolling, after all clocks were set back") {
  const simulator::Simulation simulation = simulate("flat1");
  const std::vector<Step> steps = run(simulation, set_back(6.0));
  const Restart restart = check_restart(steps);
  check_continued(simulation, restart, steps.back(), kHour);
  CHECK(restart.first->t < 9.5);
}

TEST_CASE("restart: where a given start said, and only inertial samples until they were missing") {
  const simulator::Simulation simulation = simulate("flat1");
  const double begin = 4.0, gap = 5.0, seen = 8.0;  // [s]
  GivenStart start = true_start(simulation, begin);
  start.state.p_WB.x() += 100.0;
  const auto hold_back = [=](double t, auto&) { return t < seen ? 0 : 1; };
  const auto blind = [=](double t, FeatureFrame& frame) {
    if (t < seen) frame.features.clear();
    return 1;
  };
  const auto lose = [=](double t, auto&) { return t > gap && t < seen ? 0 : 1; };
  const std::vector<Step> steps = run(simulation, {lose, hold_back, hold_back, blind}, {}, start);
  const Restart restart = check_restart(steps);
  for (const Step& step : steps) {
    if (step.estimate && step.t < seen) CHECK(step.estimate->health.aiding == Aiding::none);
  }
  check_continued(simulation, restart, steps.back());
  CHECK(restart.first->estimate->state.p_WB.x() > 90.0);
}

TEST_CASE("restart: after the state or its covariance turned into no numbers, standing, rolling and flying") {
  using Spoil = std::function<void(Filter&)>;
  const std::vector<Spoil> spoils{
      [](Filter& f) { const_cast<State&>(f.ekf().state()).imu.v_W.y() = kNaN; },
      [](Filter& f) { const_cast<State&>(f.ekf().state()).odometer.track_width = kNaN; },
      [](Filter& f) {
        const_cast<Covariance&>(f.ekf().covariance()).inflate(err::b_a, Eigen::Matrix3d::Constant(kNaN));
      }};
  for (const char* sequence : {"static", "flat1", "fly1"}) {
    CAPTURE(sequence);
    const simulator::Simulation simulation = simulate(sequence);
    for (std::size_t i = 0; i < spoils.size(); ++i) {
      CAPTURE(i);
      bool spoiled = false;
      const std::vector<Step> steps = run(simulation, {}, [&](double t, Filter& filter) {
        if (t < 8.0 || spoiled) return;
        spoiled = true;
        spoils[i](filter);
      });
      const Restart restart = check_restart(steps);
      check_continued(simulation, restart, steps.back());
      CHECK(restart.first->t < 11.5);
    }
  }
}
