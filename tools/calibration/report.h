// A calibration as one HTML page that needs nothing else: what was found, and residuals before and after.
#pragma once

#include <string>

#include "calibration/calibrate.h"

namespace ear::calibration {

/// `title` names what was driven.
[[nodiscard]] std::string to_html(const std::string& title, const Result& result);

}  // namespace ear::calibration
