#include "src/jpeg.h"

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <opencv2/core.hpp>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>
#include <vector>

namespace ear {
namespace {

constexpr int kQuality = 60;

}  // namespace

std::string jpeg(const ImageView& image, int most_width) {
  if (image.empty()) return "";
  // OpenCV has no view of constant pixels; nothing writes to these.
  const cv::Mat view(image.height, image.width, CV_8UC1, const_cast<std::uint8_t*>(image.data),
                     static_cast<std::size_t>(image.stride));
  cv::Mat small = view;
  if (image.width > most_width) {
    const double scale = static_cast<double>(most_width) / image.width;
    cv::resize(view, small, cv::Size(most_width, std::max(1, static_cast<int>(scale * image.height))), 0, 0,
               cv::INTER_AREA);
  }
  std::vector<std::uint8_t> bytes;
  if (!cv::imencode(".jpg", small, bytes, {cv::IMWRITE_JPEG_QUALITY, kQuality})) return "";
  return std::string(bytes.begin(), bytes.end());
}

}  // namespace ear
