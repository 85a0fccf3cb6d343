// What this program is: for bug reports, and beside measurements.
#pragma once

#include <string>

#include "ear/config.h"

namespace ear::tools {

/// Of the sources; with "-changed" where these differed from it; "unknown" where they were built without their history.
[[nodiscard]] std::string commit();

/// Of the front end with these settings, on this processor. Throws std::invalid_argument where it does not have them.
[[nodiscard]] std::string kernels_here(const Config& config);

/// Lines: version and commit; the kernels that the front end takes here, and all that this processor can run; the
/// optional parts that were built.
[[nodiscard]] std::string version_text();

}  // namespace ear::tools
