#include "tools/experiments/simulation_truth.h"

#include <algorithm>
#include <iterator>

namespace ear::experiments {
namespace {

/// Where truth is recorded from the first to the last, and those of `times` between them.
std::vector<TimeNs> stamps(const simulator::Simulation& simulation, const std::vector<TimeNs>& times) {
  const std::vector<TimeNs>& recorded = simulation.truth_times();
  std::vector<TimeNs> inside;
  std::copy_if(times.begin(), times.end(), std::back_inserter(inside),
               [&](TimeNs t_ns) { return t_ns >= recorded.front() && t_ns <= recorded.back(); });
  std::vector<TimeNs> all;
  std::set_union(recorded.begin(), recorded.end(), inside.begin(), inside.end(), std::back_inserter(all));
  return all;
}

}  // namespace

SimulationTruth truth_of(const simulator::Simulation& simulation, const std::vector<TimeNs>& times) {
  SimulationTruth result;
  for (const TimeNs t_ns : stamps(simulation, times)) {
    const simulator::Truth truth = simulation.truth(t_ns);
    result.poses.push_back({t_ns, Eigen::Quaterniond(truth.R_WB), truth.p_WB});
    result.terrain.push_back({t_ns, truth.mode == simulator::Mode::ground, {truth.slope_along, truth.slope_across}});
  }
  return result;
}

void append(evaluation::Estimate& to, const Estimate& estimate) {
  const NavState& x = estimate.state;
  to.poses.push_back({x.t_ns, x.q_WB, x.p_WB});
  // The evaluation's order is position, rotation.
  const auto block = [&](int a, int b) { return estimate.covariance.block<3, 3>(a, b); };
  evaluation::PoseCovariance P;
  P << block(estimate_error::position, estimate_error::position),
      block(estimate_error::position, estimate_error::rotation),
      block(estimate_error::rotation, estimate_error::position),
      block(estimate_error::rotation, estimate_error::rotation);
  to.covariance.push_back(P);
  to.health.emplace_back(estimate.health.status == HealthStatus::tracking ? "tracking" : "degraded");
  evaluation::TerrainEstimate ground;
  ground.on_ground = estimate.frame.on_ground;
  const TerrainEstimate& terrain = estimate.terrain;
  if (terrain.known) ground.slope = evaluation::Slope{terrain.slope_along, terrain.slope_across};
  ground.sigma = {terrain.sigma_along, terrain.sigma_across};
  to.terrain.push_back(ground);
}

}  // namespace ear::experiments
