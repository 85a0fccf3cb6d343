// One run of an estimator, and its result.
#pragma once

#include <filesystem>

#include "tools/paper/measure/configuration.h"
#include "tools/paper/measure/result.h"
#include "tools/simulator/simulation.h"

namespace ear::paper {

/// On a simulation's feature tracks, in memory. The estimator is given Simulation::calibration().
[[nodiscard]] Result run_on_tracks(const simulator::Simulation& simulation, const Configuration& configuration);

/// On a recording with images, at its camera's rate or a lower one [Hz].
[[nodiscard]] Result run_on_images(const std::filesystem::path& recording, double camera_rate_hz,
                                   const Configuration& configuration);

}  // namespace ear::paper
