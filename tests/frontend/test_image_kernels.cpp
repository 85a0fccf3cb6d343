// Every variant that this processor can run gives the same bits, and those that the formulas say.
#include <doctest/doctest.h>

#include <array>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <opencv2/imgproc.hpp>
#include <random>
#include <stdexcept>
#include <vector>

#include "frontend/image_kernels.h"
#include "frontend/image_pyramid.h"
#include "scene.h"

namespace ear {
namespace {

template <class T>
bool same_bits(const T& a, const T& b) {
  return std::memcmp(&a, &b, sizeof(T)) == 0;  // NOLINT(bugprone-suspicious-memory-comparison): bits of floats
}

// FNV-1a, 64 bits.
class Digest {
 public:
  template <class T>
  void add(const T& values) {
    std::array<unsigned char, sizeof(T)> bytes;
    std::memcpy(bytes.data(), &values, sizeof(T));
    for (const unsigned char byte : bytes) value_ = (value_ ^ byte) * 1099511628211ULL;
  }
  [[nodiscard]] std::uint64_t value() const { return value_; }

 private:
  std::uint64_t value_ = 14695981039346656037ULL;
};

// Upright and turned, stretched and not, near the image's edge and far from it.
PatchPlace random_place(std::mt19937& random, float most) {
  std::uniform_real_distribution<float> uniform(-1.0F, 1.0F);
  const float bend = 0.01F * most;
  return {{160.0F + 100.0F * uniform(random), 120.0F + 60.0F * uniform(random)},
          {1.0F + most * uniform(random), most * uniform(random)},
          {most * uniform(random), 1.0F + most * uniform(random)},
          {bend * uniform(random), bend * uniform(random)}};
}

// The image between its pixels, in double.
double interpolated(const GreyLevel& level, double x, double y) {
  const double left = std::floor(x);
  const double top = std::floor(y);
  const std::uint8_t* const p = level.origin + static_cast<int>(top) * level.stride + static_cast<int>(left);
  const auto row = [&](const std::uint8_t* q) { return q[0] + (x - left) * (q[1] - q[0]); };
  return row(p) + (y - top) * (row(p + level.stride) - row(p));
}

// What align_affine() is to give, term by term.
std::array<double, 9> expected_sums(const GreyLevel& level, const PatchPlace& place, const PatchPixels& patch) {
  std::array<double, 9> sums{};
  for (int row = 0; row < kPatchSize; ++row) {
    for (int column = 0; column < kPatchSize; ++column) {
      const double ox = column - 7.5;
      const double oy = row - 7.5;
      const double scale = 1.0 - place.perspective[0] * ox - place.perspective[1] * oy;
      const double x = place.centre[0] + (place.column_x[0] * ox + place.column_y[0] * oy) * scale;
      const double y = place.centre[1] + (place.column_x[1] * ox + place.column_y[1] * oy) * scale;
      const double pixel = interpolated(level, x, y) - patch.mean;
      const auto at = static_cast<std::size_t>(row * kPatchSize + column);
      const double value = kPatchUnit * patch.value[at];
      const double gx = kGradientUnit * patch.gradient_x[at] * pixel;
      const double gy = kGradientUnit * patch.gradient_y[at] * pixel;
      const std::array<double, 9> terms{pixel,   pixel * pixel, value * pixel, gx,     gy,
                                        gx * ox, gx * oy,       gy * ox,       gy * oy};
      for (std::size_t i = 0; i < terms.size(); ++i) sums[i] += terms[i];
    }
  }
  return sums;
}

}  // namespace

TEST_CASE("kernels: all variants of this processor give the same bits") {
  const std::vector<ImageKernels> variants = image_kernels();
  REQUIRE(!variants.empty());
  ImagePyramid pyramid(variants.front());
  pyramid.build(view_of(random_texture(320, 240, 11)));
  const GreyLevel& level = pyramid.level(0);
  std::mt19937 random(12);
  std::uniform_real_distribution<float> uniform(-1.0F, 1.0F);
  for (const ImageKernels& variant : variants) {
    CAPTURE(name_of(variant.kind));
    for (int trial = 0; trial < 3000; ++trial) {
      CAPTURE(trial);
      const PatchPlace place = random_place(random, trial % 3 == 0 ? 0.5F : 0.1F);
      const std::array<float, 2> centre{160.0F + 100.0F * uniform(random), 120.0F + 60.0F * uniform(random)};
      PatchPixels patch, patch0;
      variants.front().capture(level, centre, patch0);
      variant.capture(level, centre, patch);
      REQUIRE(same_bits(patch.value, patch0.value));
      REQUIRE(same_bits(patch.gradient_x, patch0.gradient_x));
      REQUIRE(same_bits(patch.gradient_y, patch0.gradient_y));
      REQUIRE(patch.mean == patch0.mean);
      PatchMoments moments{}, moments0{};
      variants.front().moments(patch0, moments0);
      variant.moments(patch0, moments);
      REQUIRE(same_bits(moments, moments0));
      PatchMoments position{}, position0{};
      variants.front().position_moments(patch0, position0);
      variant.position_moments(patch0, position);
      REQUIRE(same_bits(position, position0));
      REQUIRE(position.gx_gy.one == doctest::Approx(moments.gx_gy.one).epsilon(1e-5).scale(1e5));
      REQUIRE(position.gy_value.one == doctest::Approx(moments.gy_value.one).epsilon(1e-5).scale(1e5));
      REQUIRE(position.middle2 == doctest::Approx(moments.middle2).epsilon(1e-5));
      for (const auto kernel : {&ImageKernels::align_position, &ImageKernels::align_affine, &ImageKernels::compare}) {
        AlignmentSums sums{}, sums0{};
        (variants.front().*kernel)(level, place, patch0, sums0);
        (variant.*kernel)(level, place, patch0, sums);
        REQUIRE(same_bits(sums, sums0));
      }
      std::array<AlignmentSums, kPatchSize> along{}, along0{};
      variants.front().compare_along(level, place, patch0, along0);
      variant.compare_along(level, place, patch0, along);
      REQUIRE(same_bits(along, along0));
    }
  }
}

// Only exact arithmetic, and random numbers that are the same in every standard library.
TEST_CASE("kernels: the bits are the same on every kind of processor") {
  constexpr std::uint64_t kEverywhere = 0x1d03c42b4f47dc6a;  // x86-64 and 64-bit Arm, g++ 12 and clang 14
  for (const ImageKernels& kernels : image_kernels()) {
    CAPTURE(name_of(kernels.kind));
    std::mt19937 random(5);
    const auto uniform = [&] { return static_cast<float>(static_cast<int>(random() >> 21) - 1024) / 1024.0F; };
    cv::Mat image(240, 320, CV_8U);
    for (int row = 0; row < image.rows; ++row) {
      for (int column = 0; column < image.cols; ++column) {
        image.at<std::uint8_t>(row, column) = static_cast<std::uint8_t>(random());
      }
    }
    ImagePyramid pyramid(kernels);
    pyramid.build(view_of(image));
    Digest digest;
    for (int trial = 0; trial < 1000; ++trial) {
      const float most = trial % 3 == 0 ? 0.5F : 0.125F;
      const GreyLevel& level = pyramid.level(trial % 2);
      PatchPlace place{};
      for (const auto member : {&PatchPlace::column_x, &PatchPlace::column_y, &PatchPlace::perspective}) {
        for (float& value : place.*member) value = most * uniform();
      }
      place.column_x[0] += 1.0F;
      place.column_y[1] += 1.0F;
      for (float& value : place.perspective) value *= 0.0625F;
      place.centre = {80.0F + 16.0F * uniform(), 60.0F + 16.0F * uniform()};
      PatchPixels patch;
      kernels.capture(level, place.centre, patch);
      digest.add(patch.value);
      digest.add(patch.gradient_x);
      digest.add(patch.gradient_y);
      PatchMoments moments{};
      kernels.moments(patch, moments);
      digest.add(moments.gx_gx);
      digest.add(moments.gy_gy);
      AlignmentSums sums{};
      kernels.align_affine(level, place, patch, sums);
      digest.add(sums);
      std::array<AlignmentSums, kPatchSize> along{};
      kernels.compare_along(level, place, patch, along);
      for (const AlignmentSums& each : along) digest.add(std::array<float, 3>{each.image, each.image2, each.product});
      std::array<std::uint8_t, 128> scores{};
      kernels.corner_scores(level.origin + (20 + trial % 64) * level.stride + 8, level.stride, 96, 0, scores.data());
      digest.add(scores);
    }
    CHECK(digest.value() == kEverywhere);
  }
}

TEST_CASE("kernels: the sums are those of the image between its pixels") {
  const ImageKernels kernels = image_kernels(Kernels::best);
  ImagePyramid pyramid;
  pyramid.build(view_of(random_texture(320, 240, 13)));
  const GreyLevel& level = pyramid.level(0);
  PatchPixels patch;
  kernels.capture(level, {100.3F, 90.7F}, patch);
  std::mt19937 random(14);
  for (int trial = 0; trial < 300; ++trial) {
    CAPTURE(trial);
    const PatchPlace place = random_place(random, trial % 2 == 0 ? 0.1F : 0.5F);
    AlignmentSums sums{};
    kernels.align_affine(level, place, patch, sums);
    const std::array<float, 9> found{sums.image, sums.image2, sums.product, sums.x,  sums.y,
                                     sums.x_x,   sums.x_y,    sums.y_x,     sums.y_y};
    const std::array<double, 9> expected = expected_sums(level, place, patch);
    // In each of 256 pixels, a sixteenth of a grey value of rounding and 2^-12 px times the steepest slopes of the
    // image; of the sum of the pixels only what all have in common is left.
    const std::array<double, 9> terms{5.0, 500.0, 250.0, 100.0, 100.0, 750.0, 750.0, 750.0, 750.0};
    for (std::size_t i = 0; i < found.size(); ++i) {
      CAPTURE(i);
      CHECK(std::abs(found[i] - expected[i]) < 256 * 0.005 * terms[i]);
    }
  }
}

TEST_CASE("kernels: texture is the sums of differences over 15x15 pixels") {
  ImagePyramid pyramid;
  pyramid.build(view_of(random_texture(320, 240, 20)));
  const GreyLevel& level = pyramid.level(0);
  for (const ImageKernels& variant : image_kernels()) {
    CAPTURE(name_of(variant.kind));
    for (int trial = 0; trial < 50; ++trial) {
      const int u = 10 + 6 * trial;
      const int v = 10 + 4 * trial;
      TextureSums expected{};
      for (int row = v - 7; row <= v + 7; ++row) {
        for (int column = u - 7; column <= u + 7; ++column) {
          const std::uint8_t* const p = level.origin + row * level.stride + column;
          const int across = p[1] - *(p - 1);
          const int down = p[level.stride] - *(p - level.stride);
          expected.across2 += across * across;
          expected.down2 += down * down;
          expected.across_down += across * down;
          expected.right2 += (p[1] - p[0]) * (p[1] - p[0]);
          expected.below2 += (p[level.stride] - p[0]) * (p[level.stride] - p[0]);
        }
      }
      TextureSums found{};
      variant.texture(level.origin + v * level.stride + u, level.stride, found);
      REQUIRE(same_bits(found, expected));
    }
  }
}

TEST_CASE("kernels: a patch is what is between the pixels, and how that changes") {
  const ImageKernels kernels = image_kernels(Kernels::best);
  ImagePyramid pyramid;
  pyramid.build(view_of(random_texture(320, 240, 18)));
  const GreyLevel& level = pyramid.level(0);
  std::mt19937 random(19);
  std::uniform_real_distribution<float> uniform(-60.0F, 60.0F);
  for (int trial = 0; trial < 50; ++trial) {
    CAPTURE(trial);
    const std::array<float, 2> centre{160.0F + uniform(random), 120.0F + uniform(random)};
    PatchPixels patch;
    kernels.capture(level, centre, patch);
    const auto pixel = [&](int column, int row) {
      return interpolated(level, centre[0] - 7.5 + column, centre[1] - 7.5 + row);
    };
    for (int row = 0; row < kPatchSize; ++row) {
      for (int column = 0; column < kPatchSize; ++column) {
        const auto at = static_cast<std::size_t>(row * kPatchSize + column);
        const double slope = (8.0 * (pixel(column + 1, row) - pixel(column - 1, row)) - pixel(column + 2, row) +
                              pixel(column - 2, row)) /
                             12.0;
        REQUIRE(std::abs(patch.mean + kPatchUnit * patch.value[at] - pixel(column, row)) < 0.08);
        REQUIRE(std::abs(kGradientUnit * patch.gradient_x[at] - slope) < 0.12);
      }
    }
  }
}

TEST_CASE("kernels: a patch is compared with a row of places at once as it is with each") {
  const ImageKernels kernels = image_kernels(Kernels::best);
  ImagePyramid pyramid;
  pyramid.build(view_of(random_texture(320, 240, 16)));
  const GreyLevel& level = pyramid.level(0);
  PatchPixels patch;
  kernels.capture(level, {100.3F, 90.7F}, patch);
  std::mt19937 random(17);
  for (int trial = 0; trial < 100; ++trial) {
    CAPTURE(trial);
    PatchPlace place = random_place(random, trial % 2 == 0 ? 0.1F : 0.5F);
    place.perspective = {0.0F, 0.0F};
    std::array<AlignmentSums, kPatchSize> along{};
    kernels.compare_along(level, place, patch, along);
    for (const AlignmentSums& found : along) {
      AlignmentSums expected{};
      kernels.compare(level, place, patch, expected);
      CHECK(found.image == doctest::Approx(expected.image).epsilon(0.01).scale(300.0));
      CHECK(found.image2 == doctest::Approx(expected.image2).epsilon(0.01).scale(1e4));
      CHECK(found.product == doctest::Approx(expected.product).epsilon(0.01).scale(1e4));
      for (std::size_t k = 0; k < 2; ++k) place.centre[k] += place.column_x[k];
    }
  }
}

TEST_CASE("kernels: every level is half of the one below, as OpenCV halves images") {
  for (const cv::Size& size : {cv::Size(320, 240), cv::Size(333, 251), cv::Size(70, 41)}) {
    CAPTURE(size.width);
    cv::Mat expected = random_texture(size.width, size.height, 15);
    for (const ImageKernels& variant : image_kernels()) {
      CAPTURE(name_of(variant.kind));
      ImagePyramid pyramid(variant);
      pyramid.build(view_of(expected));
      cv::Mat below = expected;
      for (int i = 1; i <= pyramid.top_level(); ++i) {
        cv::Mat half;
        cv::pyrDown(below, half);
        const GreyLevel& level = pyramid.level(i);
        REQUIRE(level.width == half.cols);
        REQUIRE(level.height == half.rows);
        for (int row = 0; row < half.rows; ++row) {
          REQUIRE(std::memcmp(level.origin + row * level.stride, half.ptr(row), static_cast<std::size_t>(half.cols)) ==
                  0);
        }
        below = half;
      }
    }
  }
}

TEST_CASE("kernels: those of another processor, and names that are none, are refused") {
#if defined(__x86_64__)
  CHECK_THROWS_WITH_AS(static_cast<void>(image_kernels(Kernels::neon)),
                       "frontend: this processor does not have the kernels neon", std::invalid_argument);
  CHECK(image_kernels(Kernels::sse2).kind == Kernels::sse2);
#else
  CHECK_THROWS_AS(static_cast<void>(image_kernels(Kernels::avx2)), std::invalid_argument);
#endif
  CHECK_THROWS_WITH_AS(static_cast<void>(kernels_named("mmx")),
                       "no kernels are called \"mmx\"; there are best, sse2, sse4, avx2, neon, plain",
                       std::invalid_argument);
  CHECK(kernels_named("avx2") == Kernels::avx2);
}

}  // namespace ear
