#include <doctest/doctest.h>

#include <algorithm>
#include <array>
#include <opencv2/features2d.hpp>
#include <random>
#include <tuple>
#include <vector>

#include "frontend/fast_corners.h"
#include "scene.h"

namespace ear {
namespace {

using Found = std::vector<std::tuple<int, int, int>>;  // score, row, column

Found opencv_corners(const cv::Mat& image, const PixelArea& area, int threshold) {
  constexpr int kReach = 3;
  const cv::Rect searched(area.left - kReach, area.top - kReach, area.width + 2 * kReach, area.height + 2 * kReach);
  std::vector<cv::KeyPoint> keypoints;
  cv::FAST(image(searched), keypoints, threshold, true);
  Found found;
  for (const cv::KeyPoint& k : keypoints) {
    found.emplace_back(-static_cast<int>(k.response), static_cast<int>(k.pt.y) + searched.y,
                       static_cast<int>(k.pt.x) + searched.x);
  }
  std::sort(found.begin(), found.end());
  return found;
}

}  // namespace

TEST_CASE("fast: the corners and scores are those of OpenCV, by every variant of the kernels") {
  std::mt19937 random(21);
  const std::array<PixelArea, 4> areas{
      PixelArea{10, 10, 45, 45}, {100, 60, 32, 31}, {3, 3, 314, 234}, {250, 200, 60, 30}};
  for (const ImageKernels& kernels : image_kernels()) {
    CAPTURE(name_of(kernels.kind));
    std::size_t count = 0;
    for (const double noise : {0.0, 4.0, 60.0}) {
      cv::Mat image = random_texture(320, 240, 22);
      if (noise > 0.0) add_noise(image, noise, random);
      ImagePyramid pyramid(kernels);
      pyramid.build(view_of(image));
      FastCorners fast;
      for (const PixelArea& area : areas) {
        for (const int threshold : {7, 20, 1, 140}) {
          CAPTURE(threshold);
          fast.find(pyramid, area, threshold);
          Found found;
          while (const auto corner = fast.take_strongest()) found.emplace_back(-corner->score, corner->v, corner->u);
          CHECK(std::is_sorted(found.begin(), found.end()));
          CHECK(found == opencv_corners(image, area, threshold));
          count += found.size();
        }
      }
    }
    CHECK(count > 1000);
  }
}

}  // namespace ear
