// The settings a subcommand runs with: those of its --config file, and of the environment.
#pragma once

#include <filesystem>

#include "ear/config.h"

namespace ear::tools {

/// EAR_KERNELS, where it is set, names the kernels of front end and filter (`sse2`, ...; for tests and comparisons).
/// Throws std::invalid_argument for a name that is none; of kernels that this processor does not have, the front end's
/// constructor complains.
[[nodiscard]] Config with_environment(Config config);

/// The file's, or the defaults if `file` is empty, with_environment().
[[nodiscard]] Config program_config(const std::filesystem::path& file);

}  // namespace ear::tools
