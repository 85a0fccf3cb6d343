#include "frontend/image_pyramid.h"

#include <algorithm>

#include <opencv2/video/tracking.hpp>

namespace ear {

bool ImagePyramid::shows(const ImageView& image) const {
  if (levels_.empty() || levels_.front().width != image.width || levels_.front().height != image.height) return false;
  const GreyLevel& base = levels_.front();
  for (std::ptrdiff_t row = 0; row < image.height; ++row) {
    const std::uint8_t* const pixels = image.data + row * image.stride;
    if (!std::equal(pixels, pixels + image.width, base.origin + row * base.stride)) return false;
  }
  return true;
}

void ImagePyramid::build(const ImageView& image) {
  // OpenCV takes no const pixels; it only reads them.
  const cv::Mat view(image.height, image.width, CV_8UC1, const_cast<std::uint8_t*>(image.data),
                     static_cast<std::size_t>(image.stride));
  cv::buildOpticalFlowPyramid(view, mats_, cv::Size(kBorder, kBorder), kMaxLevels - 1, false, cv::BORDER_REFLECT_101,
                              cv::BORDER_CONSTANT, false);
  levels_.clear();
  for (const cv::Mat& mat : mats_) {
    levels_.push_back({mat.data, mat.cols, mat.rows, static_cast<std::ptrdiff_t>(mat.step[0]), kBorder});
  }
}

}  // namespace ear
