// What an image is worth before anything is tracked in it.
#pragma once

#include "frontend/frontend.h"
#include "frontend/image_pyramid.h"

namespace ear {

/// Fills brightness and sharpness; the rest stays zero. Sharpness is the mean squared difference [grey^2] of pixels two
/// apart in a row, on every fourth row: blur lowers it, but so does a wall. Compare it with earlier images of the same
/// camera, not with a constant.
[[nodiscard]] ImageQuality measure_quality(const GreyLevel& image);

}  // namespace ear
