#include "tools/floor.h"

#include <opencv2/imgproc.hpp>
#include <opencv2/video/tracking.hpp>

#include "tools/processor_time.h"

namespace ear::tools {
namespace {

// OpenCV takes no const pixels; it only reads them.
cv::Mat mat_of(const ImageView& image) {
  return {image.height, image.width, CV_8UC1, const_cast<std::uint8_t*>(image.data),
          static_cast<std::size_t>(image.stride)};
}

}  // namespace

double Floor::measure(const StereoFrame& frame) {
  const cv::Size window(15, 15);
  constexpr int kLevels = 3;
  const cv::TermCriteria criteria(cv::TermCriteria::COUNT | cv::TermCriteria::EPS, 10, 0.01);
  const cv::Mat left = mat_of(frame.left);
  std::vector<cv::Point2f> points;
  if (!last_left_.empty()) cv::goodFeaturesToTrack(last_left_, points, points_, 0.001, 15.0);

  const double start = thread_time();
  std::vector<cv::Mat> pyramid;
  std::vector<cv::Mat> right_pyramid;
  cv::buildOpticalFlowPyramid(left, pyramid, window, kLevels);
  cv::buildOpticalFlowPyramid(mat_of(frame.right), right_pyramid, window, kLevels);
  if (!points.empty()) {
    std::vector<cv::Point2f> tracked;
    std::vector<cv::Point2f> matched;
    std::vector<std::uint8_t> status;
    std::vector<float> error;
    cv::calcOpticalFlowPyrLK(last_pyramid_, pyramid, points, tracked, status, error, window, kLevels, criteria);
    cv::calcOpticalFlowPyrLK(pyramid, right_pyramid, tracked, matched, status, error, window, kLevels, criteria);
  }
  const double seconds = thread_time() - start;

  left.copyTo(last_left_);
  last_pyramid_ = std::move(pyramid);
  return seconds;
}

}  // namespace ear::tools
