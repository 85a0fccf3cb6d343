#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <opencv2/core.hpp>
#include <random>
#include <stdexcept>

#include "frontend/detector.h"
#include "frontend/stereo_matcher.h"
#include "scene.h"

namespace ear {
namespace {

constexpr double kNearest = 0.3;

struct Pair {
  explicit Pair(const std::vector<TexturedRectangle>& what, LensModel lens = LensModel::radial_tangential)
      : scene(what), cameras(test_stereo_pair(lens)) {
    std::mt19937 random(7);
    left_image = Camera(cameras[0]).render(Eigen::Isometry3d::Identity(), scene);
    right_image = Camera(cameras[1]).render(Eigen::Isometry3d::Identity(), scene);
    add_noise(left_image, 2.0, random);
    add_noise(right_image, 2.0, random);
    left.build(view_of(left_image));
    right.build(view_of(right_image));
  }

  std::vector<TexturedRectangle> scene;
  std::vector<CameraCalibration> cameras;
  cv::Mat left_image, right_image;
  ImagePyramid left, right;
};

struct Result {
  int tried = 0;
  int found = 0;
  int followed = 0;       // found again from half a pixel of disparity away
  int wrong = 0;          // more than 2 px from the truth
  double error_px = 0.0;  // rms of disparity, of those that are right
};

Result search_all(const Pair& pair) {
  const StereoMatcher matcher(pair.cameras[0], pair.cameras[1], kNearest);
  const Lens lens(pair.cameras[0]);
  const Lens right_lens(pair.cameras[1]);
  Result result;
  const auto corners = Detector(320, 240, 100).detect(pair.left, {}, 100);
  for (const Corner& corner : corners) {
    ReferencePatch patch;
    const auto ray = lens.to_normalized(corner.pixel.cast<double>());
    if (!ray || !patch.capture(pair.left, corner.pixel)) continue;
    const auto point = hit(Eigen::Isometry3d::Identity(), *ray, pair.scene);
    if (!point) continue;
    const auto seen = right_lens.to_pixel((pair.cameras[1].T_BC.inverse() * *point).hnormalized());
    if (!seen || seen->x() < 8.0 || seen->y() < 8.0 || seen->x() > 311.0 || seen->y() > 231.0) continue;
    ++result.tried;
    const auto match = matcher.search(pair.right, patch, {corner.pixel}, *ray);
    if (!match) continue;
    ++result.found;
    const double error = (*right_lens.to_pixel(match->right) - *seen).norm();
    if (error > 2.0) {
      ++result.wrong;
    } else {
      result.error_px += error * error;
    }
    if (error < 0.5) {
      const double per_pixel = matcher.inverse_depth_per_pixel();
      const double inverse_depth = match->surface.inverse_depth(*ray);
      CHECK(std::abs(inverse_depth - 1.0 / point->z()) < per_pixel);
      const SurfacePatch shifted =
          SurfacePatch::through(*ray, inverse_depth + 0.5 * per_pixel, match->surface.gradient());
      const auto again = matcher.follow(pair.right, patch, {corner.pixel}, *ray, shifted);
      if (again && (again->right - match->right).norm() < 0.1 / 200.0) ++result.followed;
    }
  }
  result.error_px = std::sqrt(result.error_px / std::max(1, result.found - result.wrong));
  return result;
}

}  // namespace

TEST_CASE("stereo: points are found from near to far, with both lenses") {
  for (const LensModel lens : {LensModel::radial_tangential, LensModel::equidistant}) {
    for (const double distance : {0.4, 1.0, 4.0, 100.0}) {
      CAPTURE(distance);
      const Result result = search_all(Pair({wall(distance, 8)}, lens));
      CHECK(result.tried > 60);
      CHECK(result.found > 0.9 * result.tried);
      CHECK(result.followed > 0.97 * result.found);
      CHECK(result.wrong == 0);
      CHECK(result.error_px < 0.1);
    }
  }
}

TEST_CASE("stereo: on a floor that runs away from the camera") {
  const Result result = search_all(Pair({floor_below(0.25, 9)}));
  CHECK(result.tried > 30);
  CHECK(result.found > 0.7 * result.tried);
  CHECK(result.wrong <= 1);
  CHECK(result.error_px < 0.3);
}

TEST_CASE("stereo: what is followed tells how the surface leans") {
  const double height = 0.25;
  for (const bool on_floor : {true, false}) {
    CAPTURE(on_floor);
    const Pair pair({on_floor ? floor_below(height, 9) : wall(1.0, 9)});
    const StereoMatcher matcher(pair.cameras[0], pair.cameras[1], kNearest);
    const Lens lens(pair.cameras[0]);
    std::vector<double> gradients;
    Detector detector(320, 240, 100);
    for (const Corner& corner : detector.detect(pair.left, {}, 100)) {
      ReferencePatch patch;
      const auto ray = lens.to_normalized(corner.pixel.cast<double>());
      if (!ray || ray->y() < 0.2 || !patch.capture(pair.left, corner.pixel)) continue;
      auto match = matcher.search(pair.right, patch, {corner.pixel}, *ray);
      for (int frame = 0; match && frame < 3; ++frame) {
        match = matcher.follow(pair.right, patch, {corner.pixel}, *ray, match->surface);
      }
      if (match) gradients.push_back(match->surface.gradient().y());
    }
    REQUIRE(gradients.size() > 20);
    std::nth_element(gradients.begin(), gradients.begin() + static_cast<std::ptrdiff_t>(gradients.size() / 2),
                     gradients.end());
    const double truth = on_floor ? 1.0 / height : 0.0;
    CHECK(std::abs(gradients[gradients.size() / 2] - truth) < 0.4);  // a tenth of the floor's
  }
}

TEST_CASE("stereo: texture that repeats along the line is rather left out than guessed") {
  TexturedRectangle tiles = wall(1.0, 10);
  const cv::Mat tile = tiles.texture(cv::Rect(0, 0, 24, 800)).clone();
  for (int u = 0; u + 24 <= tiles.texture.cols; u += 24) tile.copyTo(tiles.texture(cv::Rect(u, 0, 24, 800)));
  const Result result = search_all(Pair({tiles}));
  CHECK(result.tried > 30);
  CHECK(result.wrong < 0.15 * result.tried);
}

TEST_CASE("stereo: two different images have little in common") {
  Pair pair({wall(1.0, 11)});
  const cv::Mat other = Camera(pair.cameras[1]).render(Eigen::Isometry3d::Identity(), {wall(1.0, 12)});
  pair.right.build(view_of(other));
  const Result result = search_all(pair);
  CHECK(result.tried > 60);
  CHECK(result.found < 0.03 * result.tried);
}

TEST_CASE("stereo: what is off the epipolar line is not a match") {
  Pair pair({wall(1.0, 14)});
  pair.cameras[1].T_BC.rotate(Eigen::AngleAxisd(0.02, Eigen::Vector3d::UnitX()));  // the images are 4 px too high
  const Result result = search_all(pair);
  CHECK(result.tried > 60);
  CHECK(result.found < 0.03 * result.tried);
}

TEST_CASE("stereo: off the epipolar line, as far as the cameras say that they may be wrong") {
  Pair pair({wall(1.0, 14)});
  const std::vector<CameraCalibration> truth = pair.cameras;
  pair.cameras[1].T_BC.rotate(Eigen::AngleAxisd(0.03, Eigen::Vector3d::UnitX()));  // the images are 6 px too high
  SUBCASE("the right one turned") { pair.cameras[1].pose_sigma = PoseSigma{0.02, 1e-4}; }
  SUBCASE("principal points") {
    for (CameraCalibration& camera : pair.cameras) camera.intrinsics_sigma = IntrinsicsSigma{1.0, 2.8};
  }
  const StereoMatcher matcher(pair.cameras[0], pair.cameras[1], kNearest);
  const Lens lens(truth[0]);
  const Lens right_lens(truth[1]);
  Detector detector(320, 240, 100);
  int tried = 0, right = 0, followed = 0;
  for (const Corner& corner : detector.detect(pair.left, {}, 100)) {
    ReferencePatch patch;
    const auto ray = lens.to_normalized(corner.pixel.cast<double>());
    if (!ray || !patch.capture(pair.left, corner.pixel)) continue;
    const auto point = hit(Eigen::Isometry3d::Identity(), *ray, pair.scene);
    const auto seen = right_lens.to_pixel((truth[1].T_BC.inverse() * *point).hnormalized());
    if (!seen || seen->x() < 15.0 || seen->y() < 15.0 || seen->x() > 304.0 || seen->y() > 224.0) continue;
    ++tried;
    const auto match = matcher.search(pair.right, patch, {corner.pixel}, *ray);
    if (!match || (*right_lens.to_pixel(match->right) - *seen).norm() > 0.5) continue;
    ++right;
    if (matcher.follow(pair.right, patch, {corner.pixel}, *ray, match->surface)) ++followed;
  }
  CHECK(tried > 60);
  CHECK(right > 0.9 * tried);
  CHECK(followed > 0.9 * right);
}

TEST_CASE("stereo: what is followed must be where it was") {
  const Pair pair({wall(1.0, 13)});
  const StereoMatcher matcher(pair.cameras[0], pair.cameras[1], kNearest);
  const Eigen::Vector2f pixel(150.5F, 120.5F);
  ReferencePatch patch;
  REQUIRE(patch.capture(pair.left, pixel));
  const Eigen::Vector2d ray = *Lens(pair.cameras[0]).to_normalized(pixel.cast<double>());
  CHECK(matcher.follow(pair.right, patch, {pixel}, ray, SurfacePatch::through(ray, 1.0)));
  CHECK_FALSE(matcher.follow(pair.right, patch, {pixel}, ray, SurfacePatch::through(ray, 3.0)));
}

TEST_CASE("stereo: two cameras in one place are refused") {
  auto cameras = test_stereo_pair();
  cameras[1].T_BC = cameras[0].T_BC;
  CHECK_THROWS_AS(StereoMatcher(cameras[0], cameras[1], kNearest), std::invalid_argument);
}

}  // namespace ear
