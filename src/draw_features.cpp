#include "src/draw_features.h"

#include <opencv2/imgproc.hpp>
#include <stdexcept>

#include "frontend/lens.h"

namespace ear {

std::vector<std::uint8_t> draw_features(const ImageView& left, const FeatureFrame& features,
                                        const CameraCalibration& camera) {
  constexpr int kRadius = 4;  // [px]
  const cv::Scalar both(0, 255, 0), left_alone(0, 255, 255);
  if (left.empty() || left.width != camera.width || left.height != camera.height) {
    throw std::invalid_argument("draw_features: the image is not of the camera's size");
  }
  const cv::Mat grey(left.height, left.width, CV_8UC1, const_cast<std::uint8_t*>(left.data),  // NOLINT: only read
                     static_cast<std::size_t>(left.stride));
  std::vector<std::uint8_t> pixels(std::size_t{3} * grey.total());
  cv::Mat colour(left.height, left.width, CV_8UC3, pixels.data());
  cv::cvtColor(grey, colour, cv::COLOR_GRAY2BGR);
  const Lens lens(camera);
  for (const FeatureObservation& feature : features.features) {
    const auto pixel = lens.to_pixel(feature.left);
    if (!pixel) continue;
    cv::circle(colour, {cvRound(pixel->x()), cvRound(pixel->y())}, kRadius, feature.has_right ? both : left_alone);
  }
  return pixels;
}

}  // namespace ear
