#include "tools/simulator/texture.h"

#include <opencv2/imgproc.hpp>
#include <stdexcept>

namespace ear::simulator {

Texture::Texture(const cv::Mat& base, double texel) {
  if (base.type() != CV_8UC1 || base.cols % kTextureMultiple != 0 || base.rows % kTextureMultiple != 0) {
    throw std::invalid_argument("a texture needs 8-bit grey and sizes that are multiples of " +
                                std::to_string(kTextureMultiple));
  }
  cv::Mat image = base;
  for (double size = texel;; size *= 2.0) {
    Level level;
    level.image = image;
    level.data = level.image.data;
    level.stride = static_cast<int>(image.step);
    // The last pair of pixels starts just below the last but one.
    level.max_s = static_cast<float>(image.cols - 1) - 1e-3F;
    level.max_t = static_cast<float>(image.rows - 1) - 1e-3F;
    level.per_metre = static_cast<float>(1.0 / size);
    levels_.push_back(level);
    if (image.cols < 4 || image.rows < 4 || image.cols % 2 != 0 || image.rows % 2 != 0) return;
    cv::Mat half;
    cv::resize(image, half, {}, 0.5, 0.5, cv::INTER_AREA);
    image = half;
  }
}

}  // namespace ear::simulator
