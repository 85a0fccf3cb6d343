#include "frontend/detector.h"

#include <algorithm>
#include <cmath>
#include <opencv2/features2d.hpp>

#include "frontend/patch.h"

namespace ear {
namespace {

constexpr int kMargin = 10;                // [px] from the image's edge: the patch and a bit
constexpr int kFastReach = 3;              // [px] radius of FAST's circle: cells are searched with this overlap
constexpr std::array<int, 2> kThresholds{20, 7};  // grey steps of FAST, tried in this order
constexpr std::size_t kCandidates = 5;     // of one cell, ranked by FAST's score, that are looked at closely
constexpr float kMinStrength = 1000.0F;     // [grey^2] 3 grey values of noise then move a patch by 0.15 px
constexpr int kMaxPerCell = 3;

bool far_from_all(const Eigen::Vector2f& pixel, const std::vector<Eigen::Vector2f>& others, float distance) {
  return std::none_of(others.begin(), others.end(), [&](const Eigen::Vector2f& other) {
    return (other - pixel).squaredNorm() < distance * distance;
  });
}

// Smaller eigenvalue of the structure matrix of 15x15 pixels around a pixel.
float corner_strength(const GreyLevel& image, int u, int v) {
  constexpr int kReach = 7;
  int xx = 0, xy = 0, yy = 0;
  for (int row = v - kReach; row <= v + kReach; ++row) {
    const std::uint8_t* p = image.origin + row * image.stride + u - kReach;
    for (int column = 0; column <= 2 * kReach; ++column, ++p) {
      const int gx = p[1] - *(p - 1);
      const int gy = p[image.stride] - *(p - image.stride);
      xx += gx * gx;
      xy += gx * gy;
      yy += gy * gy;
    }
  }
  const float a = 0.125F * static_cast<float>(xx + yy);  // half the trace; gradients are differences over two pixels
  const float b = 0.125F * static_cast<float>(xx - yy);
  const float c = 0.25F * static_cast<float>(xy);
  return a - std::sqrt(b * b + c * c);
}

// Half a pixel right and down of a pixel lies the middle of an even patch that needs no interpolation.
Eigen::Vector2f patch_centre(const cv::Point2f& pixel) { return {pixel.x + 0.5F, pixel.y + 0.5F}; }

}  // namespace

Detector::Detector(int width, int height, int max_features)
    : width_(width), height_(height), columns_(1), rows_(1), cell_(1.0F), min_distance_(1.0F) {
  cell_ = std::sqrt(static_cast<float>(width) * static_cast<float>(height) / static_cast<float>(max_features));
  cell_ = std::max(cell_, 2.0F * kMargin);
  columns_ = std::max(1, static_cast<int>(std::ceil(static_cast<float>(width) / cell_)));
  rows_ = std::max(1, static_cast<int>(std::ceil(static_cast<float>(height) / cell_)));
  min_distance_ = 0.4F * cell_;
}

std::vector<int> Detector::count_per_cell(const std::vector<Eigen::Vector2f>& pixels) const {
  std::vector<int> count(static_cast<std::size_t>(columns_ * rows_), 0);
  for (const Eigen::Vector2f& pixel : pixels) {
    const int column = std::clamp(static_cast<int>(pixel.x() / cell_), 0, columns_ - 1);
    const int row = std::clamp(static_cast<int>(pixel.y() / cell_), 0, rows_ - 1);
    ++count[static_cast<std::size_t>(row * columns_ + column)];
  }
  return count;
}

double Detector::coverage(const std::vector<Eigen::Vector2f>& pixels) const {
  const std::vector<int> count = count_per_cell(pixels);
  const auto held = std::count_if(count.begin(), count.end(), [](int n) { return n > 0; });
  return static_cast<double>(held) / static_cast<double>(count.size());
}

std::vector<Corner> Detector::detect(const ImagePyramid& pyramid, const std::vector<Eigen::Vector2f>& taken,
                                     int wanted) {
  std::vector<Corner> corners;
  if (wanted <= 0) return corners;
  std::vector<Eigen::Vector2f> occupied = taken;
  std::vector<int> count = count_per_cell(taken);
  const std::size_t cells = count.size();
  const GreyLevel& image = pyramid.level(0);
  std::vector<cv::KeyPoint> keypoints;
  for (int round = 0; round < kMaxPerCell && static_cast<int>(corners.size()) < wanted; ++round) {
    for (std::size_t k = 0; k < cells && static_cast<int>(corners.size()) < wanted; ++k) {
      const std::size_t cell = (next_ + k) % cells;
      if (count[cell] != round) continue;
      const int column = static_cast<int>(cell) % columns_;
      const int row = static_cast<int>(cell) / columns_;
      const int left = std::max(static_cast<int>(static_cast<float>(column) * cell_), kMargin) - kFastReach;
      const int top = std::max(static_cast<int>(static_cast<float>(row) * cell_), kMargin) - kFastReach;
      const int right = std::min(static_cast<int>(static_cast<float>(column + 1) * cell_), width_ - kMargin) + kFastReach;
      const int bottom = std::min(static_cast<int>(static_cast<float>(row + 1) * cell_), height_ - kMargin) + kFastReach;
      if (right - left <= 2 * kFastReach || bottom - top <= 2 * kFastReach) continue;
      const cv::Mat roi = pyramid.image()(cv::Range(top, bottom), cv::Range(left, right));
      for (const int threshold : kThresholds) {
        cv::FAST(roi, keypoints, threshold, true);
        const cv::Point2f offset(static_cast<float>(left), static_cast<float>(top));
        for (cv::KeyPoint& keypoint : keypoints) keypoint.pt += offset;
        keypoints.erase(std::remove_if(keypoints.begin(), keypoints.end(), [&](const cv::KeyPoint& keypoint) {
                          return !far_from_all(patch_centre(keypoint.pt), occupied, min_distance_);
                        }), keypoints.end());
        const auto stronger = [](const cv::KeyPoint& a, const cv::KeyPoint& b) {
          if (a.response != b.response) return a.response > b.response;
          return a.pt.y != b.pt.y ? a.pt.y < b.pt.y : a.pt.x < b.pt.x;
        };
        const std::size_t looked_at = std::min(keypoints.size(), kCandidates);
        std::partial_sort(keypoints.begin(), keypoints.begin() + static_cast<std::ptrdiff_t>(looked_at),
                          keypoints.end(), stronger);
        Corner best;
        for (std::size_t i = 0; i < looked_at; ++i) {
          const cv::Point2f& pt = keypoints[i].pt;
          const float strength = corner_strength(image, static_cast<int>(pt.x), static_cast<int>(pt.y));
          if (strength > best.strength) best = {patch_centre(pt), strength};
        }
        if (best.strength < kMinStrength) continue;
        corners.push_back(best);
        occupied.push_back(best.pixel);
        ++count[cell];
        break;
      }
    }
  }
  next_ = (next_ + cells / 3 + 1) % cells;
  return corners;
}

}  // namespace ear
