// What a recording has to show of the moments of an estimate.
#pragma once

#include <filesystem>
#include <vector>

#include "tools/evaluation/moments.h"

namespace ear::tools {

/// The foremost twenty moments, with strikes after landings, as the inertial samples have them, and with the images of
/// the left camera. What is no recording's folder, or has no such file, adds nothing. Throws InputError for a file that
/// is there and cannot be read.
[[nodiscard]] std::vector<evaluation::Moment> film(std::vector<evaluation::Moment> moments,
                                                   const std::filesystem::path& recording);

}  // namespace ear::tools
