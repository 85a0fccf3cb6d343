#include "filter/sources/cameras/lens_pattern.h"

#include <doctest/doctest.h>

#include <array>
#include <cmath>
#include <functional>
#include <random>
#include <vector>

#include "filter/ekf/so3.h"

using namespace ear;

namespace {

constexpr double kNoise = 5e-4;  // of a feature's right observation, each axis: 0.2 px of 385

CameraState side_by_side() {
  CameraState cameras;
  cameras.T_C0C1.R = exp_so3({0.01, -0.02, 0.015});
  cameras.T_C0C1.p = {0.1, 0.002, -0.001};
  cameras.lens_error[1].focal_length = 0.002;
  return cameras;
}

CameraState one_above_the_other() {
  CameraState cameras;
  cameras.T_C0C1.R = exp_so3({0.0, 0.02, 0.0});
  cameras.T_C0C1.p = {0.001, 0.1, 0.0};
  return cameras;
}

struct Feature {
  Eigen::Vector2d left, right;
};

/// Where the right camera sees what the left one sees at `left`, `z` away.
Eigen::Vector2d right_of(const CameraState& cameras, const Eigen::Vector2d& left, double z) {
  const Eigen::Vector3d p_C1 = cameras.T_C0C1.R.transpose() * (z * left.homogeneous() - cameras.T_C0C1.p);
  return cameras.lens_error[1].measured(p_C1.hnormalized());
}

/// Points 1 to 20 m away, over cells of the image; what the lens does to the right observation, and noise.
std::vector<Feature> look(const CameraState& cameras, int count, std::mt19937_64& rng,
                          const std::function<Eigen::Vector2d(const Eigen::Vector2d&)>& lens) {
  std::normal_distribution<double> noise(0.0, kNoise);
  std::uniform_real_distribution<double> x(-0.75, 0.75), y(-0.5, 0.5), depth(std::log(1.0), std::log(20.0));
  std::vector<Feature> features;
  for (int i = 0; i < count; ++i) {
    const Eigen::Vector2d left(x(rng), y(rng));
    const Eigen::Vector2d right = right_of(cameras, left, std::exp(depth(rng)));
    features.push_back({left, right + lens(left) + Eigen::Vector2d(noise(rng), noise(rng))});
  }
  return features;
}

LensPattern pattern_of(const std::vector<Feature>& features, const CameraState& cameras) {
  LensPattern pattern;
  for (const Feature& feature : features) pattern.add(feature.left, feature.right, cameras);
  return pattern;
}

Eigen::Vector2d no_error(const Eigen::Vector2d& /*left*/) { return Eigen::Vector2d::Zero(); }

/// An error in each cell of 0.25 by 0.25, both axes alike.
class CellErrors {
 public:
  CellErrors(double sigma, std::mt19937_64& rng) {
    std::normal_distribution<double> normal(0.0, sigma);
    for (auto& error : errors_) error = {normal(rng), normal(rng)};
  }
  Eigen::Vector2d operator()(const Eigen::Vector2d& left) const {
    const auto column = static_cast<std::size_t>(std::floor(left.x() / 0.25) + 4.0);
    const auto row = static_cast<std::size_t>(std::floor(left.y() / 0.25) + 3.0);
    return errors_.at(8 * row + column);
  }

 private:
  std::array<Eigen::Vector2d, 48> errors_;
};

}  // namespace

TEST_CASE("lens pattern: what is measured is what there is, for cameras beside and above each other") {
  for (const CameraState& cameras : {side_by_side(), one_above_the_other()}) {
    for (const double sigma : {0.0, 1e-4, 8e-4}) {
      double variance = 0.0;
      constexpr int kRuns = 100;
      for (std::uint64_t seed = 0; seed < kRuns; ++seed) {
        std::mt19937_64 rng(seed);
        const CellErrors lens(sigma, rng);
        variance += std::pow(pattern_of(look(cameras, 960, rng, lens), cameras).sigma(), 2) / kRuns;
      }
      // Of 24 cells with 40 features each. Less than nothing counts as nothing: noise alone leaves a little.
      const double chance = kNoise * kNoise / 40.0 * std::sqrt(2.0 / 24.0);
      CHECK(variance == doctest::Approx(sigma * sigma).epsilon(0.2).scale(5.0 * chance));
    }
  }
}

TEST_CASE("lens pattern: what it does to the scale, against a fit to disparities with such errors") {
  const CameraState cameras = side_by_side();
  constexpr double kError = 1e-3;
  constexpr int kRuns = 300;
  double stated = 0.0, found = 0.0;
  for (std::uint64_t seed = 0; seed < kRuns; ++seed) {
    std::mt19937_64 rng(seed);
    const CellErrors lens(kError, rng);
    const std::vector<Feature> features = look(cameras, 800, rng, lens);
    stated += std::pow(pattern_of(features, cameras).scale_sigma(), 2) / kRuns;
    // Along the rows, which are the epipolar lines to within the turn of the right camera.
    double disparities = 0.0, projected = 0.0;
    for (const Feature& feature : features) {
      const double disparity = (right_of(cameras, feature.left, 1e6) - feature.right).x();
      disparities += disparity * disparity;
      projected += disparity * lens(feature.left).x();
    }
    found += std::pow(projected / disparities, 2) / kRuns;
  }
  CHECK(std::abs(std::sqrt(stated / found) - 1.0) < 0.15);  // the scatter of 300 draws is 0.04
  CHECK(std::sqrt(found) > 0.003);                          // 24 cells of 1 mrad, disparities of some 50
}

TEST_CASE("lens pattern: nothing before there are features; what was seen long ago is forgotten") {
  const CameraState cameras = side_by_side();
  LensPattern pattern;
  pattern.forget();
  CHECK(pattern.sigma() == 0.0);
  CHECK(pattern.scale_sigma() == 0.0);
  std::mt19937_64 rng(5);
  const CellErrors lens(2e-3, rng);
  const auto frames = [&](int count, const std::function<Eigen::Vector2d(const Eigen::Vector2d&)>& error) {
    for (int i = 0; i < count; ++i) {
      for (const Feature& feature : look(cameras, 40, rng, error)) pattern.add(feature.left, feature.right, cameras);
      pattern.forget();
    }
  };
  frames(50, lens);
  CHECK(pattern.sigma() > 1.5e-3);
  frames(200, no_error);
  CHECK(pattern.sigma() < 3e-4);
  pattern.reset();
  CHECK(pattern.sigma() == 0.0);
}

TEST_CASE("lens pattern: an observation at infinity, or none that a camera can have, leaves it a number") {
  const CameraState cameras = side_by_side();
  LensPattern pattern;
  std::mt19937_64 rng(7);
  for (const Feature& feature : look(cameras, 200, rng, no_error)) pattern.add(feature.left, feature.right, cameras);
  pattern.add({1e9, -1e9}, {1e9, 1e9}, cameras);
  pattern.add({NAN, 0.0}, {0.0, 0.0}, cameras);
  CameraState same_place = cameras;
  same_place.T_C0C1.p.setZero();
  pattern.add({0.1, 0.0}, {0.1, 0.0}, same_place);
  CHECK(std::isfinite(pattern.sigma()));
  CHECK(std::isfinite(pattern.scale_sigma()));
}
