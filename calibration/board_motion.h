// What the motion of a board shows of cameras, and the words for what it does not.
#pragma once

#include <string>
#include <vector>

#include "calibration/board.h"

namespace ear::calibration {

[[nodiscard]] BoardCoverage coverage_of(const std::vector<CameraCalibration>& cameras, const BoardShape& board,
                                        const std::vector<BoardView>& views);

/// One sentence for each thing that is missing.
[[nodiscard]] std::vector<std::string> advice_on(const BoardCoverage& coverage, std::size_t cameras, std::size_t views,
                                                 const std::vector<Finding>& findings);

/// By the name of an entry: "tilt the board by 30 to 45 degrees to all sides".
[[nodiscard]] std::string board_motion_that_shows(const std::string& entry);

}  // namespace ear::calibration
