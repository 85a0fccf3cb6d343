// One level of an image pyramid, as its kernels see it: plain pixels, no library.
#pragma once

#include <cstddef>
#include <cstdint>

namespace ear {

/// A pixel (u, v) of the image is at (u, v) / 2^level here.
struct GreyLevel {
  const std::uint8_t* origin = nullptr;  ///< pixel (0, 0)
  int width = 0;
  int height = 0;
  std::ptrdiff_t stride = 0;
  int border = 0;  ///< mirrored pixels that may be read on each side
};

}  // namespace ear
