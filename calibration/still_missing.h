// What a drive has not shown well enough so far, and what to do about it.
#pragma once

#include <string>
#include <vector>

#include "calibration/findings.h"

namespace ear::calibration {

/// A motion, and the numbers that it would show.
struct MissingMotion {
  std::string motion;
  std::vector<std::string> entries;  ///< their names
};

/// How well a number should be known, in its unit: about twice what the recommended drive shows. 0: whatever was shown
/// is enough.
[[nodiscard]] double wanted_sigma(const Finding& finding);

/// The motions that show most first.
[[nodiscard]] std::vector<MissingMotion> still_missing(const std::vector<Finding>& findings);

/// "31 of 48 numbers are known", and a line for each motion that is wanted.
[[nodiscard]] std::string missing_text(const std::vector<Finding>& findings);

}  // namespace ear::calibration
