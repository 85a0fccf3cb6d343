// Images from files, as 8-bit grey.
#pragma once

#include <filesystem>
#include <opencv2/core/mat.hpp>
#include <string>

#include "src/recording/warnings.h"

namespace ear {

/// Reads any image type that OpenCV knows. Colours become grey, 16 bits are scaled down to 8 with a warning. An image
/// that cannot be read is empty, with a warning; one that is cut off counts as such. `camera` ("cam0") names the
/// stream.
[[nodiscard]] cv::Mat read_image(const std::filesystem::path& file, const std::string& camera, Warnings& warnings);

}  // namespace ear
