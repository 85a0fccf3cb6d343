#include <doctest/doctest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <opencv2/imgproc.hpp>
#include <random>

#include "frontend/image_pyramid.h"
#include "frontend/reference_patch.h"
#include "scene.h"
#include "tests/support/about.h"

namespace ear {
namespace {

using test::about;

// The image moved so that what was at x is at A x + t; sharp texture, interpolated well.
cv::Mat warped(const cv::Mat& image, const Eigen::Matrix2f& affine, const Eigen::Vector2f& shift) {
  const cv::Matx23f m(affine(0, 0), affine(0, 1), shift.x(), affine(1, 0), affine(1, 1), shift.y());
  cv::Mat out;
  cv::warpAffine(image, out, m, image.size(), cv::INTER_LANCZOS4, cv::BORDER_REFLECT_101);
  return out;
}

// The image in which what was at centre + o is at centre + o / (1 + perspective . o).
cv::Mat foreshortened(const cv::Mat& image, const Eigen::Vector2f& centre, const Eigen::Vector2f& perspective) {
  const auto shift = [&](float sign) {
    Eigen::Matrix3f T = Eigen::Matrix3f::Identity();
    T.topRightCorner<2, 1>() = sign * centre;
    return T;
  };
  Eigen::Matrix3f P = Eigen::Matrix3f::Identity();
  P.bottomLeftCorner<1, 2>() = perspective.transpose();
  const Eigen::Matrix3f H = shift(1.0F) * P * shift(-1.0F);
  const cv::Matx33f m(H(0, 0), H(0, 1), H(0, 2), H(1, 0), H(1, 1), H(1, 2), H(2, 0), H(2, 1), H(2, 2));
  cv::Mat out;
  cv::warpPerspective(image, out, m, image.size(), cv::INTER_LANCZOS4, cv::BORDER_REFLECT_101);
  return out;
}

ImagePyramid pyramid_of(const cv::Mat& image) {
  ImagePyramid pyramid;
  pyramid.build(view_of(image));
  return pyramid;
}

}  // namespace

TEST_CASE("pyramid: levels halve the image, and its border mirrors it") {
  const ImagePyramid pyramid = pyramid_of(random_texture(320, 240, 1));
  REQUIRE(pyramid.top_level() == 3);
  CHECK(pyramid.level(3).width == 40);
  CHECK(pyramid.level(3).height == 30);
  const GreyLevel& level = pyramid.level(1);
  CHECK(*(level.origin - 5) == level.origin[5]);
  CHECK(*(level.origin - 7 * level.stride) == level.origin[7 * level.stride]);
}

TEST_CASE("pyramid: an image too small for all levels has fewer") {
  CHECK(pyramid_of(random_texture(40, 40, 1)).top_level() < 3);
}

TEST_CASE("pyramid: rows that are asked for are those of the whole, in whatever order") {
  std::mt19937 random(4);
  for (const cv::Size& size : {cv::Size(320, 240), cv::Size(333, 251), cv::Size(70, 41)}) {
    CAPTURE(size.width);
    const ImagePyramid whole = pyramid_of(random_texture(size.width, size.height, 3));
    ImagePyramid asked = pyramid_of(random_texture(size.width, size.height, 4));
    static_cast<void>(asked.level(asked.top_level()));                 // of the image before, everything
    asked.build(view_of(random_texture(size.width, size.height, 3)));  // and nothing of this one
    for (int trial = 0; trial < 40; ++trial) {
      const int index = static_cast<int>(random() % static_cast<unsigned>(whole.top_level() + 1));
      const GreyLevel& expected = whole.level(index);
      constexpr int kBorder = ImagePyramid::kBorder;
      const int first = static_cast<int>(random() % static_cast<unsigned>(expected.height + kBorder)) - kBorder;
      const int last = std::min(first + 12, expected.height - 1 + kBorder);
      CAPTURE(first);
      const GreyLevel& level = asked.level(index, first, last);
      for (int row = first; row <= last; ++row) {
        const auto bytes = static_cast<std::size_t>(level.width + 2 * kBorder);
        REQUIRE(std::memcmp(level.origin + row * level.stride - kBorder,
                            expected.origin + row * expected.stride - kBorder, bytes) == 0);
      }
    }
  }
}

TEST_CASE("patch: a step that only noise makes has a chi-square of one for each parameter") {
  const cv::Mat image = random_texture(320, 240, 8);
  const ImagePyramid before = pyramid_of(image);
  std::mt19937 random(9);
  for (const double noise : {2.0, 6.0}) {
    CAPTURE(noise);
    float position = 0.0F;
    float affine = 0.0F;
    int count = 0;
    for (int trial = 0; trial < 20; ++trial) {
      cv::Mat noisy = image.clone();
      add_noise(noisy, noise, random);
      const ImagePyramid after = pyramid_of(noisy);
      for (float u = 40.5F; u < 300.0F; u += 40.0F) {
        const Eigen::Vector2f at(u, 120.5F);
        PatchLevel patch;
        REQUIRE(patch.capture(before.kernels(), before.level(0), at));
        Warp warp{at};
        const auto first = patch.step_position(after.kernels(), after.level(0), 1.0F, warp);
        warp = {at};
        const auto second = patch.step_affine(after.kernels(), after.level(0), Eigen::Matrix2f::Identity(), 1.0F, warp);
        REQUIRE(first);
        REQUIRE(second);
        position += first->chi2;
        affine += second->chi2;
        ++count;
      }
    }
    CHECK(position / static_cast<float>(count) == about(2.0, 0.25));
    CHECK(affine / static_cast<float>(count) == about(6.0, 0.25));
  }
}

TEST_CASE("patch: a shift is found to a few hundredths of a pixel, from pixels away, whatever the exposure") {
  const cv::Mat image = random_texture(320, 240, 2);
  const ImagePyramid before = pyramid_of(image);
  std::mt19937 random(3);
  std::uniform_real_distribution<float> uniform(-1.0F, 1.0F);
  double squares = 0.0;
  int count = 0;
  for (int trial = 0; trial < 20; ++trial) {
    CAPTURE(trial);
    const Eigen::Vector2f shift(12.0F * uniform(random), 12.0F * uniform(random));
    cv::Mat moved = warped(image, Eigen::Matrix2f::Identity(), shift);
    moved.convertTo(moved, CV_8U, 0.7, 20.0);
    add_noise(moved, 2.0, random);
    const ImagePyramid after = pyramid_of(moved);
    for (const float u : {80.5F, 160.5F, 240.5F}) {
      const Eigen::Vector2f at(u, 120.5F);
      ReferencePatch patch;
      REQUIRE(patch.capture(before, at));
      const auto match = patch.align(after, {at, Eigen::Matrix2f::Identity()}, 3);
      REQUIRE(match);
      const float error = (match->warp.centre - at - shift).norm();
      CHECK(error < 0.15F);
      squares += error * error;
      ++count;
      CHECK(match->correlation > 0.9F);
    }
  }
  CHECK(std::sqrt(squares / count) < 0.05);
}

TEST_CASE("patch: one step goes most of the way, whatever the exposure") {
  const cv::Mat image = random_texture(320, 240, 7);
  const ImagePyramid before = pyramid_of(image);
  const Eigen::Vector2f shift(0.4F, -0.3F);
  for (const double gain : {0.5, 1.0, 1.5}) {
    CAPTURE(gain);
    cv::Mat moved = warped(image, Eigen::Matrix2f::Identity(), shift);
    moved.convertTo(moved, CV_8U, gain, 128.0 * (1.0 - gain));
    const ImagePyramid after = pyramid_of(moved);
    float position_error = 0.0F;
    float affine_error = 0.0F;
    const std::array<float, 5> columns{60.5F, 110.5F, 160.5F, 210.5F, 260.5F};
    for (const float u : columns) {
      const Eigen::Vector2f at(u, 120.5F);
      PatchLevel patch;
      REQUIRE(patch.capture(before.kernels(), before.level(0), at));
      Warp warp{at, Eigen::Matrix2f::Identity()};
      REQUIRE(patch.step_position(after.kernels(), after.level(0), 1.0F, warp));
      position_error += (warp.centre - at - shift).norm() / columns.size();
      warp = {at, Eigen::Matrix2f::Identity()};
      REQUIRE(patch.step_affine(after.kernels(), after.level(0), Eigen::Matrix2f::Identity(), 1.0F, warp));
      affine_error += (warp.centre - at - shift).norm() / columns.size();
    }
    CHECK(position_error < 0.1F);
    CHECK(affine_error < 0.1F);
  }
}

TEST_CASE("patch: turn, stretch and shear are found along with the position") {
  const cv::Mat image = random_texture(320, 240, 4);
  const ImagePyramid before = pyramid_of(image);
  Eigen::Matrix2f affine;
  affine << 1.12F, 0.08F, -0.10F, 0.95F;
  const Eigen::Vector2f at(160.5F, 120.5F);
  const Eigen::Vector2f to(161.3F, 119.9F);
  const ImagePyramid after = pyramid_of(warped(image, affine, to - affine * at));
  ReferencePatch patch;
  REQUIRE(patch.capture(before, at));
  const auto match = patch.align(after, {at, Eigen::Matrix2f::Identity()}, 0);
  REQUIRE(match);
  CHECK((match->warp.centre - to).norm() < 0.05F);
  CHECK((match->warp.affine - affine).norm() < 0.04F);
}

TEST_CASE("patch: a perspective that is known does not shift the position") {
  const cv::Mat image = random_texture(320, 240, 8);
  const ImagePyramid before = pyramid_of(image);
  const Eigen::Vector2f perspective(0.001F, -0.006F);
  const Eigen::Vector2f at(160.5F, 120.5F);
  Eigen::Vector2f with = Eigen::Vector2f::Zero();
  Eigen::Vector2f without = Eigen::Vector2f::Zero();
  int count = 0;
  for (const float u : {-90.0F, -45.0F, 0.0F, 45.0F, 90.0F}) {
    for (const float v : {-60.0F, -30.0F, 0.0F, 30.0F, 60.0F}) {
      const Eigen::Vector2f centre = at + Eigen::Vector2f(u, v);
      const ImagePyramid after = pyramid_of(foreshortened(image, centre, perspective));
      ReferencePatch patch;
      if (!patch.capture(before, centre)) continue;
      const auto known = patch.align(after, {centre, Eigen::Matrix2f::Identity(), perspective}, 0);
      const auto unknown = patch.align(after, {centre}, 0);
      if (!known || !unknown) continue;
      with += known->warp.centre - centre;
      without += unknown->warp.centre - centre;
      ++count;
    }
  }
  REQUIRE(count > 20);
  CHECK(with.norm() / static_cast<float>(count) < 0.02F);
  CHECK(without.y() / static_cast<float>(count) > 0.08F);  // mean square of the patch's offsets, times perspective
}

TEST_CASE("patch: what the patch does not show stays as it was known") {
  // Texture in one direction only: a capture without a corner is refused or keeps to its prior, but never runs away.
  cv::Mat stripes(240, 320, CV_8U);
  for (int row = 0; row < stripes.rows; ++row) {
    for (int column = 0; column < stripes.cols; ++column) {
      stripes.at<std::uint8_t>(row, column) = static_cast<std::uint8_t>(128.0 + 60.0 * std::sin(0.4 * column));
    }
  }
  ReferencePatch patch;
  CHECK_FALSE(patch.capture(pyramid_of(stripes), {160.5F, 120.5F}));
}

TEST_CASE("patch: no texture, no patch; no likeness, no match; outside, nothing") {
  const ImagePyramid flat = pyramid_of(cv::Mat(240, 320, CV_8U, cv::Scalar(90)));
  const ImagePyramid textured = pyramid_of(random_texture(320, 240, 5));
  const ImagePyramid other = pyramid_of(random_texture(320, 240, 6));
  const Eigen::Vector2f at(100.5F, 100.5F);
  ReferencePatch patch;
  CHECK_FALSE(patch.capture(flat, at));
  REQUIRE(patch.capture(textured, at));
  const Warp here{at, Eigen::Matrix2f::Identity()};
  CHECK_FALSE(patch.align(flat, here, 3));
  CHECK_FALSE(patch.align(other, here, 0));
  CHECK_FALSE(patch.align(textured, {{-200.0F, 50.0F}, Eigen::Matrix2f::Identity()}, 3));
  const float nan = std::nanf("");
  CHECK_FALSE(patch.align(textured, {{nan, nan}, Eigen::Matrix2f::Identity()}, 3));
  CHECK_FALSE(patch.align(textured, {at, nan * Eigen::Matrix2f::Identity()}, 3));
  CHECK_FALSE(patch.capture(textured, {1000.0F, 10.0F}));
}

TEST_CASE("patch: noise does not match other noise, wherever the search begins") {
  // Also where it is wider than a pixel, as of a camera that smooths its images.
  std::mt19937 random(9);
  for (const double blur : {0.0, 0.7, 1.0}) {
    CAPTURE(blur);
    std::array<ImagePyramid, 2> pyramids;
    for (ImagePyramid& pyramid : pyramids) {
      cv::Mat image(240, 320, CV_8U, cv::Scalar(100));
      add_noise(image, 16.0, random);
      if (blur > 0.0) cv::GaussianBlur(image, image, cv::Size(), blur);
      pyramid.build(view_of(image));
    }
    int tried = 0;
    int matched = 0;
    for (float v = 20.5F; v < 220.0F; v += 6.0F) {
      for (float u = 20.5F; u < 300.0F; u += 6.0F) {
        ReferencePatch patch;
        if (!patch.capture(pyramids[0], {u, v})) continue;
        for (const int level : {0, 2, 3}) {
          ++tried;
          matched += patch.align(pyramids[1], {{u, v}}, level) ? 1 : 0;
        }
      }
    }
    CHECK(tried > 4000);
    CHECK(matched <= tried / 1000);
  }
}

}  // namespace ear
