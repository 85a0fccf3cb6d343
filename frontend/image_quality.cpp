#include "frontend/image_quality.h"

namespace ear {

ImageQuality measure_quality(const GreyLevel& image) {
  constexpr int kRowStep = 4;
  std::int64_t sum = 0;
  std::int64_t squares = 0;
  std::int64_t count = 0;
  for (int row = 0; row < image.height; row += kRowStep) {
    const std::uint8_t* p = image.origin + row * image.stride;
    int row_sum = 0;  // fits: 2^31 / 255^2 is 33000 pixels
    int row_squares = 0;
    for (int column = 1; column + 1 < image.width; ++column) {
      const int difference = p[column + 1] - p[column - 1];
      row_sum += p[column];
      row_squares += difference * difference;
    }
    sum += row_sum;
    squares += row_squares;
    count += image.width - 2;
  }
  ImageQuality quality;
  if (count <= 0) return quality;
  quality.brightness = static_cast<double>(sum) / static_cast<double>(count);
  quality.sharpness = static_cast<double>(squares) / static_cast<double>(count);
  return quality;
}

}  // namespace ear
