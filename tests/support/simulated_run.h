// A filter run over simulated feature tracks, and how far it is from the truth.
#pragma once

#include <Eigen/Geometry>
#include <cmath>
#include <optional>
#include <vector>

#include "filter/filter.h"
#include "tools/experiments/replay_simulation.h"
#include "tools/simulator/simulation.h"

namespace ear::test {

/// Turns and shifts the truth into the estimator's world, whose origin and yaw are the first pose.
struct WorldAlignment {
  Eigen::Matrix3d R = Eigen::Matrix3d::Identity();
  Eigen::Vector3d p = Eigen::Vector3d::Zero();

  WorldAlignment(const NavState& first, const simulator::Truth& truth) {
    const Eigen::Matrix3d D = first.q_WB.toRotationMatrix() * truth.R_WB.transpose();
    R = Eigen::AngleAxisd(std::atan2(D(1, 0) - D(0, 1), D(0, 0) + D(1, 1)), Eigen::Vector3d::UnitZ())
            .toRotationMatrix();
    p = first.p_WB - R * truth.p_WB;
  }
};

/// One estimate and its errors, true minus estimated.
struct EvaluatedEstimate {
  double t = 0.0;  ///< [s] since the first frame
  Estimate estimate;
  Eigen::Vector3d dp_W;      ///< [m]
  Eigen::Vector3d dtheta_W;  ///< [rad]
};

/// Feeds the simulation to the estimator; `change` may alter a frame's features before they go in.
inline std::vector<EvaluatedEstimate> run_estimator(Estimator& estimator, const simulator::Simulation& simulation,
                                                    const experiments::ChangeFrame& change = {}) {
  std::vector<EvaluatedEstimate> result;
  std::optional<WorldAlignment> world;
  const TimeNs first_ns = simulation.frame_times().front();
  const auto compare = [&](TimeNs stamp_ns, const Estimate& estimate) {
    const NavState& x = estimate.state;
    const simulator::Truth truth = simulation.truth(x.t_ns);
    if (!world) world.emplace(x, truth);
    result.push_back({seconds_between(first_ns, stamp_ns), estimate, world->R * truth.p_WB + world->p - x.p_WB,
                      log_so3(world->R * truth.R_WB * x.q_WB.toRotationMatrix().transpose())});
  };
  experiments::ReplayOptions options;
  options.change = change;
  experiments::replay(simulation, estimator, compare, options);
  return result;
}

inline std::vector<EvaluatedEstimate> run_filter(Filter& filter, const simulator::Simulation& simulation,
                                                 const experiments::ChangeFrame& change = {}) {
  return run_estimator(filter, simulation, change);
}

}  // namespace ear::test
