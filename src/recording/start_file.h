// A start that is given, from a file.
#pragma once

#include <filesystem>

#include "ear/given_start.h"
#include "src/recording/recording.h"

namespace ear {

/// The state to begin with, for a recording of this span: docs/recordings.md, "A start that is given". Throws
/// InputError, naming file, line and key, for what is missing, not known or not usable, and for a time outside of the
/// span.
[[nodiscard]] GivenStart load_start(const std::filesystem::path& file, const TimeSpan& span);

}  // namespace ear
