// The pictures of a recording: rendered, or shared with another recording of the same simulation.
#pragma once

#include <cstddef>
#include <filesystem>
#include <functional>
#include <string>
#include <vector>

#include "tools/simulator/camera_faults.h"
#include "tools/simulator/simulation.h"

namespace ear::simulator {

/// Where the picture that one camera takes at one time belongs.
[[nodiscard]] std::filesystem::path image_path(const std::filesystem::path& directory, std::size_t camera,
                                               TimeNs taken_ns);

/// All pictures of a simulation, frame by frame.
[[nodiscard]] std::vector<Shot> all_pictures(const Simulation& simulation);

/// Is told how many of all pictures are there; called from any thread, one at a time.
using Progress = std::function<void(std::size_t done, std::size_t total)>;

/// Renders these pictures into the recording, on that many threads. They do not depend on the number of threads.
void render_images(const Simulation& simulation, const std::vector<Shot>& pictures,
                   const std::filesystem::path& directory, int threads, const Progress& progress);

/// What pictures depend on, but for faults, one key per line: the beginning of simulation.yaml.
[[nodiscard]] std::vector<std::string> picture_origin(const Simulation& simulation);

/// simulation.yaml.
[[nodiscard]] std::filesystem::path origin_file(const std::filesystem::path& directory);

/// Throws std::runtime_error, naming the file and what it says, unless `other` holds pictures of the same simulation,
/// either without faults that change pictures or with just the same ones.
void require_same_pictures(const Simulation& simulation, const std::filesystem::path& other);

/// Uses the pictures of such a recording: hard links, or copies across file systems. Returns those that it does not
/// have, as faults change them.
[[nodiscard]] std::vector<Shot> link_images(const Simulation& simulation, const std::filesystem::path& directory,
                                            const std::filesystem::path& other);

}  // namespace ear::simulator
