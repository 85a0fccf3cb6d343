#include <doctest/doctest.h>

#include <opencv2/core.hpp>
#include <random>
#include <set>
#include <utility>

#include "frontend/detector.h"
#include "scene.h"

namespace ear {
namespace {

constexpr int kWanted = 100;

ImagePyramid pyramid_of(const cv::Mat& image) {
  ImagePyramid pyramid;
  pyramid.build(view_of(image));
  return pyramid;
}

// Share of the squares of `size` pixels, of an image of 320x240, that hold a corner.
double share_of_squares(const std::vector<Corner>& corners, int size) {
  std::set<std::pair<int, int>> held;
  for (const Corner& corner : corners) {
    held.emplace(static_cast<int>(corner.pixel.x()) / size, static_cast<int>(corner.pixel.y()) / size);
  }
  return static_cast<double>(held.size()) / (320.0 / size * 240.0 / size);
}

}  // namespace

TEST_CASE("detector: corners are spread over the image, and apart") {
  Detector detector(320, 240, kWanted);
  const auto corners = detector.detect(pyramid_of(random_texture(320, 240, 1)), {}, kWanted);
  CHECK(corners.size() == kWanted);
  CHECK(share_of_squares(corners, 40) > 0.95);
  for (std::size_t i = 0; i < corners.size(); ++i) {
    for (std::size_t j = 0; j < i; ++j) CHECK((corners[i].pixel - corners[j].pixel).norm() >= 10.0F);
  }
}

TEST_CASE("detector: gaps are filled first, what is taken is left alone") {
  Detector detector(320, 240, kWanted);
  const ImagePyramid image = pyramid_of(random_texture(320, 240, 2));
  std::vector<Eigen::Vector2f> taken;
  for (float v = 14.0F; v < 240.0F; v += 28.0F) {
    for (float u = 14.0F; u < 160.0F; u += 28.0F) taken.emplace_back(u, v);
  }
  const auto corners = detector.detect(image, taken, 40);
  REQUIRE(corners.size() == 40);
  int in_the_gap = 0;
  for (const Corner& corner : corners) {
    in_the_gap += corner.pixel.x() > 150.0F ? 1 : 0;
    for (const auto& t : taken) CHECK((corner.pixel - t).norm() >= 10.0F);
  }
  CHECK(in_the_gap >= 36);
}

TEST_CASE("detector: weak texture still gives corners, none gives none") {
  Detector detector(320, 240, kWanted);
  CHECK(detector.detect(pyramid_of(random_texture(320, 240, 3, 0.3)), {}, kWanted).size() > 50);
  for (const int grey : {0, 128, 255}) {
    CHECK(detector.detect(pyramid_of(cv::Mat(240, 320, CV_8U, cv::Scalar(grey))), {}, kWanted).empty());
  }
}

TEST_CASE("detector: in half an image of texture, textured cells give more") {
  cv::Mat image = random_texture(320, 240, 4);
  image(cv::Rect(0, 0, 320, 120)).setTo(100);
  Detector detector(320, 240, kWanted);
  CHECK(detector.detect(pyramid_of(image), {}, kWanted).size() > 70);
}

TEST_CASE("detector: noise is no texture, whatever its size and kind") {
  std::mt19937 random(6);
  Detector detector(320, 240, kWanted);
  for (const Noise& noise : {Noise{1.0}, Noise{2.0}, Noise{3.0}, Noise{4.0}, Noise{8.0}, Noise{1.5, 0.001},
                             Noise{1.5, 0.005}, Noise{3.0, 0.0, 4.0}, Noise{4.0, 0.001, 4.0}}) {
    CAPTURE(noise.pixel);
    CAPTURE(noise.hot_share);
    CAPTURE(noise.row);
    for (const double grey : {6.0, 100.0}) {
      CAPTURE(grey);
      std::size_t found = 0;
      constexpr std::size_t kImages = 10;
      for (std::size_t i = 0; i < kImages; ++i) {
        cv::Mat image(240, 320, CV_8U, cv::Scalar(grey));
        add_noise(image, noise, random);
        found += detector.detect(pyramid_of(image), {}, kWanted).size();
      }
      CHECK(found <= kImages / 2);
    }
  }
}

TEST_CASE("detector: weak texture under as much noise still gives corners") {
  // Contrast of 0.15: a standard deviation of 7 grey values, most of it in waves of many pixels.
  std::mt19937 random(7);
  Detector detector(320, 240, kWanted);
  for (const double sigma : {2.0, 3.0, 4.0}) {
    CAPTURE(sigma);
    cv::Mat image = random_texture(320, 240, 8, 0.15);
    add_noise(image, sigma, random);
    CHECK(detector.detect(pyramid_of(image), {}, kWanted).size() > 50);
  }
}

TEST_CASE("detector: nothing wanted, nothing found") {
  Detector detector(320, 240, kWanted);
  CHECK(detector.detect(pyramid_of(random_texture(320, 240, 5)), {}, 0).empty());
  CHECK(detector.detect(pyramid_of(random_texture(320, 240, 5)), {}, -3).empty());
}

}  // namespace ear
