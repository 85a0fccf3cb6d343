// FAST corners (Rosten and Drummond 2006) of a part of an image: pixels of which nine neighbours in a row, of the 16 on
// a circle of three pixels around it, are all brighter or all darker.
#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "frontend/image_pyramid.h"

namespace ear {

struct PixelArea {
  int left = 0, top = 0, width = 0, height = 0;  ///< [px]
};

struct FastCorner {
  int u = 0, v = 0;  ///< [px]
  int score = 0;     ///< largest threshold [grey values] at which it is a corner
};

class FastCorners {
 public:
  /// Finds the corners of an area of the base image, whose pixels are three pixels or more from the image's edge: those
  /// with a larger score than their eight neighbours in the area, and one of at least `threshold`, which is not 0. Asks
  /// for no memory once it has seen as large an area.
  void find(const ImagePyramid& pyramid, const PixelArea& area, int threshold);

  /// Of those that the last call found and nobody has taken yet; of equal ones the upper left one. Few are wanted of
  /// many: they are not sorted.
  [[nodiscard]] std::optional<FastCorner> take_strongest();

 private:
  std::vector<std::uint8_t> scores_;  // of the area, with zeros around
  std::vector<FastCorner> found_;     // a heap
};

}  // namespace ear
