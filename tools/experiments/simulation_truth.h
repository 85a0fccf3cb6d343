// A simulation's truth and a filter's estimates as the evaluation wants them.
#pragma once

#include <vector>

#include "ear/estimate.h"
#include "tools/evaluation/trajectory.h"
#include "tools/simulator/simulation.h"

namespace ear::experiments {

struct SimulationTruth {
  evaluation::Trajectory poses;
  std::vector<evaluation::TerrainTruth> terrain;
};

/// At the simulation's truth_times() and at `times`, so that nothing is interpolated there. `times` is in time order.
[[nodiscard]] SimulationTruth truth_of(const simulator::Simulation& simulation, const std::vector<TimeNs>& times);

/// Appends one estimate of the filter.
void append(evaluation::Estimate& to, const Estimate& estimate);

}  // namespace ear::experiments
