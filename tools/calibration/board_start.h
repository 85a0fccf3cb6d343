// Where a calibration from a board begins: from nothing but the corners.
#pragma once

#include <vector>

#include "calibration/board.h"

namespace ear::calibration {

/// Cameras of these sizes with a focal length that fits the views; their principal point in the middle, no distortion,
/// the left one at the body's origin. Sets the poses of `views` and drops those that have none. Throws
/// std::invalid_argument where a camera sees no board, or the two never see it at the same time.
[[nodiscard]] Calibration board_start(const std::vector<CameraCalibration>& sizes, LensModel lens,
                                      const BoardShape& board, std::vector<BoardView>& views);

}  // namespace ear::calibration
