// The settings a subcommand runs with: those of its --config file, and of the environment.
#pragma once

#include <filesystem>

#include "ear/config.h"

namespace ear::tools {

/// The defaults if `file` is empty. EAR_KERNELS, where it is set, names the kernels of the front end (`sse2`, ...; for
/// tests and comparisons). Throws std::invalid_argument for a name that is none; of kernels that this processor does
/// not have, the front end's constructor complains.
[[nodiscard]] Config program_config(const std::filesystem::path& file);

}  // namespace ear::tools
