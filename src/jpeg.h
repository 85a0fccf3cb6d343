// Images for a browser.
#pragma once

#include <string>

#include "ear/types.h"

namespace ear {

/// The image as JPEG, with at most `most_width` columns [px]; empty where there is none or it cannot be encoded.
[[nodiscard]] std::string jpeg(const ImageView& image, int most_width);

}  // namespace ear
