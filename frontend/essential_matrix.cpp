#include "frontend/essential_matrix.h"

#include <opencv2/calib3d.hpp>
#include <opencv2/core/mat.hpp>

namespace ear {

std::vector<std::uint8_t> essential_inliers(const std::vector<Flow>& flows, double tolerance, double confidence) {
  std::vector<cv::Point2d> from;
  std::vector<cv::Point2d> to;
  for (const Flow& flow : flows) {
    from.emplace_back(flow.x0.x(), flow.x0.y());
    to.emplace_back(flow.x1.x(), flow.x1.y());
  }
  std::vector<std::uint8_t> mask;
  cv::findEssentialMat(from, to, cv::Mat::eye(3, 3, CV_64F), cv::RANSAC, confidence, tolerance, mask);
  return mask.size() == flows.size() ? mask : std::vector<std::uint8_t>(flows.size(), 1);
}

}  // namespace ear
