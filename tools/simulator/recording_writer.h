// A simulation as a recording: the folder layout of docs/recordings.md.
#pragma once

#include <filesystem>

#include "tools/simulator/simulation.h"

namespace ear::simulator {

/// With cameras there are pictures to come; without, none of their files is written, and it is a recording of the rest.
enum class WithCameras { yes, no };

/// Writes everything but the pictures: csv files, sensor.yaml files with the given calibration, truth, truth_extra.csv,
/// faults.csv and simulation.yaml, which says what made it. Throws std::runtime_error, naming the file, if it cannot
/// write or if `directory` already holds a recording.
void write_recording(const Simulation& simulation, const std::filesystem::path& directory,
                     WithCameras cameras = WithCameras::yes);

}  // namespace ear::simulator
