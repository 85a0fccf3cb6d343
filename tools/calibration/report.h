// A calibration as one HTML page that needs nothing else: what was found, and residuals before and after.
#pragma once

#include <string>

#include "calibration/board.h"
#include "calibration/calibrate.h"

namespace ear::calibration {

/// `title` names what was driven.
[[nodiscard]] std::string to_html(const std::string& title, const Result& result);

/// Of a board: what was found, and reprojection errors over time and over each image.
[[nodiscard]] std::string to_html(const std::string& title, const BoardResult& board);

}  // namespace ear::calibration
