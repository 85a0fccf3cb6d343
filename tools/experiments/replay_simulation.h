// A filter on a simulation's samples and feature tracks: how every experiment and every test runs one.
#pragma once

#include <cstddef>
#include <functional>

#include "filter/filter.h"
#include "tools/simulator/simulation.h"

namespace ear::experiments {

/// May alter a frame's features before the filter gets them.
using ChangeFrame = std::function<void(FeatureFrame&)>;

/// Is given the estimate after each frame that has one, and the frame's index in Simulation::frame_times().
using OnEstimate = std::function<void(std::size_t frame, const Estimate& estimate)>;

/// Feeds all samples and frames in the order of their arrival.
void replay(const simulator::Simulation& simulation, Filter& filter, const OnEstimate& on_estimate,
            const ChangeFrame& change = {});

/// Feeds the samples of all other sensors, and asks for an estimate where a frame would be.
void replay_without_camera(const simulator::Simulation& simulation, Filter& filter, const OnEstimate& on_estimate);

}  // namespace ear::experiments
