// The truth as a start that is given.
#pragma once

#include "ear/given_start.h"
#include "tools/simulator/simulation.h"

namespace ear::test {

/// Of the vehicle at `t` [s] after the first frame, with the default standard deviations.
inline GivenStart true_start(const simulator::Simulation& simulation, double t) {
  const simulator::Truth truth = simulation.truth(simulation.frame_times().front() + static_cast<TimeNs>(1e9 * t));
  GivenStart start;
  start.state.t_ns = truth.t_ns;
  start.state.q_WB = Eigen::Quaterniond(truth.R_WB);
  start.state.p_WB = truth.p_WB;
  start.state.v_W = truth.v_W;
  return start;
}

}  // namespace ear::test
