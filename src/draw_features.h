// The features of an image, drawn into it, for people.
#pragma once

#include <cstdint>
#include <vector>

#include "ear/calibration.h"
#include "ear/types.h"

namespace ear {

/// Blue, green, red of each pixel, row by row: the grey image, with a green ring around each feature that both cameras
/// see, and a yellow one around those of the left camera alone. Throws std::invalid_argument for an image of another
/// size than the camera's.
[[nodiscard]] std::vector<std::uint8_t> draw_features(const ImageView& left, const FeatureFrame& features,
                                                      const CameraCalibration& camera);

}  // namespace ear
