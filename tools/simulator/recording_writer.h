// A simulation as a recording: the folder layout of docs/recordings.md.
#pragma once

#include <cstddef>
#include <filesystem>
#include <functional>
#include <string>

#include "tools/simulator/simulation.h"

namespace ear::simulator {

/// Writes everything but the pictures: csv files, sensor.yaml files with the calibration told, truth, truth_extra.csv,
/// faults.csv and simulation.yaml, which says what made it. Throws std::runtime_error, naming the file, if it cannot
/// write or if `directory` already holds a recording.
void write_recording(const Simulation& simulation, const std::filesystem::path& directory);

/// Where the picture that one camera takes at one time belongs.
[[nodiscard]] std::filesystem::path image_path(const std::filesystem::path& directory, std::size_t camera,
                                               TimeNs taken_ns);

/// Is told how many of all pictures are there; called from any thread, one at a time.
using Progress = std::function<void(std::size_t done, std::size_t total)>;

/// Renders all pictures into the recording, on that many threads. The pictures do not depend on the number of threads.
void render_images(const Simulation& simulation, const std::filesystem::path& directory, int threads,
                   const Progress& progress);

/// Throws std::runtime_error, naming the file and what it says, unless `other` holds the pictures that this simulation
/// would render.
void require_same_pictures(const Simulation& simulation, const std::filesystem::path& other);

/// Uses the pictures of such a recording: hard links, or copies across file systems.
void link_images(const Simulation& simulation, const std::filesystem::path& directory,
                 const std::filesystem::path& other);

}  // namespace ear::simulator
