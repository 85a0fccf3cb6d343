// Images from files, as 8-bit grey.
#pragma once

#include <cstdint>
#include <filesystem>
#include <opencv2/core/mat.hpp>
#include <string>
#include <vector>

#include "src/recording/warnings.h"

namespace ear {

/// Reads any image type that OpenCV knows. Colours become grey, 16 bits are scaled down to 8 with a warning. An image
/// that cannot be read is empty, with a warning; one that is cut off counts as such. `camera` ("cam0") names the
/// stream.
[[nodiscard]] cv::Mat read_image(const std::filesystem::path& file, const std::string& camera, Warnings& warnings);

/// The same of a file's bytes; `where` is what warnings name.
[[nodiscard]] cv::Mat grey_image(const std::vector<std::uint8_t>& bytes, const std::filesystem::path& where,
                                 const std::string& camera, Warnings& warnings);

}  // namespace ear
