// Which motion shows what: for refusals, and for the plan of a drive.
#pragma once

#include <string>

namespace ear::calibration {

/// By the name of an entry (blocks_of()): "turn on the spot both ways for 10 s".
[[nodiscard]] std::string motion_that_shows(const std::string& entry);

/// The drive to make, step by step, with what each step shows.
[[nodiscard]] std::string recommended_drive();

}  // namespace ear::calibration
