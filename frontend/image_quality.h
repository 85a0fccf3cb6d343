// What an image is worth before anything is tracked in it.
#pragma once

#include "frontend/frontend.h"
#include "frontend/image_pyramid.h"

namespace ear {

/// Fills brightness and sharpness; the rest stays zero. Sharpness is the mean squared difference [grey^2] of pixels two
/// apart on every fourth row, less what sensor noise alone leaves between exposures it cannot know: compare it with
/// earlier images of the same camera, not with a constant.
[[nodiscard]] ImageQuality measure_quality(const GreyLevel& image);

}  // namespace ear
