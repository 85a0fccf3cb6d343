// The filter starts in motion, says when it is lost, and comes back: on simulated feature tracks.
#include <doctest/doctest.h>

#include <Eigen/Cholesky>
#include <functional>

#include "filter/filter.h"
#include "tests/support/simulated_run.h"
#include "tools/experiments/sample_feed.h"
#include "tools/simulator/simulation.h"

using namespace ear;
using namespace ear::test;

namespace {

simulator::Simulation flight(double duration, double camera_rate_hz = 30.0) {
  simulator::Options options;
  options.sequence = "fly1";
  options.seed = 8301;
  options.duration = duration;
  options.camera_rate_hz = camera_rate_hz;
  return simulator::Simulation(options);
}

/// What may be changed on the way to the filter; t: seconds since the first frame.
struct Changes {
  double from = 0.0;  ///< [s] nothing comes before
  std::function<void(double t, ImuSample&)> imu = [](double, ImuSample&) {};
  std::function<void(double t, FeatureFrame&)> frame = [](double, FeatureFrame&) {};
};

struct Step {
  double t = 0.0;
  Health health;
  bool predicts = false;                 ///< is there a state between frames?
  std::optional<EvaluatedEstimate> now;  ///< with its errors, if there was an estimate
};

/// Without wheels and lasers.
std::vector<Step> fly(const simulator::Simulation& simulation, const Changes& changes) {
  FilterConfig config;
  config.odometer.model = OdometerModel::none;
  Filter filter(config, simulation.calibration());
  const TimeNs first_ns = simulation.frame_times().front();
  struct Receiver {
    Filter& filter;
    const Changes& changes;
    TimeNs first_ns;
    void add_imu(const ImuSample& sample) {
      ImuSample changed = sample;
      const double t = seconds_between(first_ns, sample.t_ns);
      changes.imu(t, changed);
      if (t >= changes.from) filter.add_imu(changed);
    }
    void add_encoder(const EncoderSample&) {}
    void add_laser(const LaserSample&) {}
  } receiver{filter, changes, first_ns};
  experiments::SampleFeed feed(simulation);
  std::optional<WorldAlignment> world;
  std::vector<Step> steps;
  for (std::size_t i = 0; i < simulation.frame_times().size(); ++i) {
    const TimeNs t_ns = simulation.frame_times()[i];
    feed.until_frame(t_ns, receiver);
    FeatureFrame frame = simulation.tracks(i);
    Step step;
    step.t = seconds_between(first_ns, t_ns);
    if (step.t < changes.from) continue;
    changes.frame(step.t, frame);
    if (const std::optional<Estimate> estimate = filter.process(frame)) {
      const NavState& x = estimate->state;
      const simulator::Truth truth = simulation.truth(x.t_ns);
      if (!world) world.emplace(x, truth);
      step.now = EvaluatedEstimate{step.t, *estimate, world->R * truth.p_WB + world->p - x.p_WB,
                                   log_so3(world->R * truth.R_WB * x.q_WB.toRotationMatrix().transpose())};
    }
    step.health = filter.health();
    step.predicts = filter.predict(t_ns).has_value();
    steps.push_back(step);
  }
  return steps;
}

/// In standard deviations, the mean of all axes.
double position_distance(const EvaluatedEstimate& e) {
  const Eigen::Matrix3d P = e.estimate.covariance.block<3, 3>(estimate_error::position, estimate_error::position) +
                            1e-6 * Eigen::Matrix3d::Identity();
  return std::sqrt(e.dp_W.dot(P.ldlt().solve(e.dp_W)) / 3.0);
}

void cover(FeatureFrame& frame) { frame.features.clear(); }

/// What was seen afterwards is tracked anew.
void rename(FeatureFrame& frame) {
  for (FeatureObservation& o : frame.features) o.id += 1'000'000;
}

}  // namespace

TEST_CASE("health: switched on in flight, it has a pose within two seconds, and an honest one") {
  for (const double rate : {30.0, 10.0}) {
    CAPTURE(rate);
    const simulator::Simulation simulation = flight(22.0, rate);
    Changes changes;
    changes.from = 11.0;
    const std::vector<Step> steps = fly(simulation, changes);
    double first = 0.0;
    for (const Step& step : steps) {
      if (!step.now) continue;
      if (first == 0.0) first = step.t;
      CHECK(step.health.reset_counter == 0);
    }
    CHECK(first < 13.0);
    REQUIRE(steps.back().now);
    CHECK(steps.back().now->dp_W.norm() < 0.15);  // of 9 m
    CHECK(position_distance(*steps.back().now) < 3.0);
    CHECK(steps.back().health.status == HealthStatus::tracking);
  }
}

TEST_CASE("health: blind for five seconds in flight it is lost, silent, and then goes on") {
  const simulator::Simulation simulation = flight(24.0);
  Changes changes;
  changes.frame = [](double t, FeatureFrame& frame) {
    if (t > 12.0 && t < 17.0) cover(frame);
    if (t >= 17.0) rename(frame);
  };
  const std::vector<Step> steps = fly(simulation, changes);
  for (const Step& step : steps) {
    CAPTURE(step.t);
    if (step.t > 12.5 && step.t < 13.8) {
      CHECK(step.health.status == HealthStatus::degraded);
      CHECK(step.health.aiding == Aiding::none);
    }
    if (step.t > 14.2 && step.t < 17.0) {
      CHECK(step.health.status == HealthStatus::lost);
      CHECK(step.health.quality == 0);
      CHECK_FALSE(step.now);
      CHECK_FALSE(step.predicts);
    }
    if (step.t > 19.5) {
      REQUIRE(step.now);
      CHECK(step.health.status == HealthStatus::tracking);
      CHECK(step.health.reset_counter == 1);
      CHECK(position_distance(*step.now) < 4.0);
    }
  }
}

TEST_CASE("health: a state that is wrong is found out, and begins anew where it was") {
  const simulator::Simulation simulation = flight(26.0);
  Changes changes;
  changes.imu = [](double t, ImuSample& sample) {
    if (t > 12.0 && t < 13.5) sample.accel_B += Eigen::Vector3d(4.0, -3.0, 0.0);
  };
  changes.frame = [](double t, FeatureFrame& frame) {
    if (t > 11.9 && t < 13.5) cover(frame);
    if (t >= 13.5) rename(frame);
  };
  const std::vector<Step> steps = fly(simulation, changes);
  bool was_lost = false;
  for (const Step& step : steps) was_lost = was_lost || step.health.status == HealthStatus::lost;
  CHECK(was_lost);
  REQUIRE(steps.back().now);
  CHECK(steps.back().health.status == HealthStatus::degraded);
  CHECK(steps.back().health.faulty.none());
  CHECK(steps.back().health.imprecise);  // nothing shows again where it was
  CHECK(steps.back().health.reset_counter >= 1);
  CHECK(position_distance(*steps.back().now) < 4.0);
  const Eigen::Matrix<double, estimate_error::size, estimate_error::size>& P = steps.back().now->estimate.covariance;
  CHECK(P.block<3, 3>(estimate_error::position, estimate_error::position).trace() > 0.5);  // it cannot know better
}
