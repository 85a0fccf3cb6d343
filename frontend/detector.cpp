#include "frontend/detector.h"

#include <algorithm>
#include <cmath>

namespace ear {
namespace {

constexpr int kMargin = 10;     // [px] from the image's edge: the patch and a bit
constexpr int kGoodScore = 20;  // grey steps of FAST: lower ones count where there is none of these
constexpr int kMinScore = 7;
constexpr std::size_t kCandidates = 5;   // of one cell, ranked by FAST's score, that are looked at closely
constexpr float kMinStrength = 1000.0F;  // [grey^2] 3 grey values of noise then move a patch by 0.15 px
constexpr float kNoiseGrowth = 1.36F;    // wider_than_noise(): noise exceeds it with probability 1e-4
constexpr int kMaxPerCell = 3;

bool far_from_all(const Eigen::Vector2f& pixel, const std::vector<Eigen::Vector2f>& others, float distance) {
  return std::none_of(others.begin(), others.end(), [&](const Eigen::Vector2f& other) {
    return (other - pixel).squaredNorm() < distance * distance;
  });
}

// Smaller eigenvalue of the structure matrix of 15x15 pixels.
float corner_strength(const TextureSums& sums) {
  // Half the trace; gradients are differences over two pixels.
  const float a = 0.125F * static_cast<float>(sums.across2 + sums.down2);
  const float b = 0.125F * static_cast<float>(sums.across2 - sums.down2);
  const float c = 0.25F * static_cast<float>(sums.across_down);
  return a - std::sqrt(b * b + c * c);
}

// Texture, or noise? Noise is independent from pixel to pixel: over two pixels it differs as much as over one. With N
// pixels of variance s^2 both sums of squared differences have the mean 2 N s^2, and they differ by 2 sum (w_i w_{i+1}
// - w_{i-1} w_{i+1}), whose variance is 8 N s^4, and by squares at the ends of the rows, 4 s^4 for each of 15: for N =
// 225 the ratio of the sums is 1 with a standard deviation of 0.096. What is wider than a pixel differs more over two
// pixels, as all that a lens has drawn: a step twice, a slope four times. The size of the noise cancels; a hot pixel
// counts alike in both sums; rows or columns that are off as a whole show in one of the two directions only.
bool wider_than_noise(const TextureSums& sums) {
  return static_cast<float>(sums.across2) > kNoiseGrowth * static_cast<float>(sums.right2) &&
         static_cast<float>(sums.down2) > kNoiseGrowth * static_cast<float>(sums.below2);
}

// Half a pixel right and down of a pixel lies the middle of an even patch that needs no interpolation.
Eigen::Vector2f patch_centre(const FastCorner& corner) {
  return {static_cast<float>(corner.u) + 0.5F, static_cast<float>(corner.v) + 0.5F};
}

}  // namespace

Detector::Detector(int width, int height, int max_features) : width_(width), height_(height) {
  cell_ = std::sqrt(static_cast<float>(width) * static_cast<float>(height) / static_cast<float>(max_features));
  cell_ = std::max(cell_, 2.0F * kMargin);
  columns_ = std::max(1, static_cast<int>(std::ceil(static_cast<float>(width) / cell_)));
  rows_ = std::max(1, static_cast<int>(std::ceil(static_cast<float>(height) / cell_)));
  min_distance_ = 0.4F * cell_;
  count_.reserve(static_cast<std::size_t>(columns_ * rows_));
  const auto most = static_cast<std::size_t>(std::max(max_features, 0));
  occupied_.reserve(2 * most);
  corners_.reserve(most);
}

void Detector::count_per_cell(const std::vector<Eigen::Vector2f>& pixels) {
  count_.assign(static_cast<std::size_t>(columns_ * rows_), 0);
  for (const Eigen::Vector2f& pixel : pixels) {
    const int column = std::clamp(static_cast<int>(pixel.x() / cell_), 0, columns_ - 1);
    const int row = std::clamp(static_cast<int>(pixel.y() / cell_), 0, rows_ - 1);
    ++count_[static_cast<std::size_t>(row * columns_ + column)];
  }
}

// Where corners of a cell may lie: the cell, less the image's margin.
PixelArea Detector::area_of(std::size_t cell) const {
  const int column = static_cast<int>(cell) % columns_;
  const int row = static_cast<int>(cell) / columns_;
  const auto edge = [&](int index) { return static_cast<int>(static_cast<float>(index) * cell_); };
  const int left = std::max(edge(column), kMargin);
  const int top = std::max(edge(row), kMargin);
  return {left, top, std::min(edge(column + 1), width_ - kMargin) - left,
          std::min(edge(row + 1), height_ - kMargin) - top};
}

std::optional<Corner> Detector::best_in_cell(const ImagePyramid& pyramid, std::size_t cell) {
  const PixelArea area = area_of(cell);
  if (area.width <= 0 || area.height <= 0) return std::nullopt;
  fast_.find(pyramid, area, kMinScore);
  const GreyLevel& image = pyramid.level(0);
  Corner best;
  int best_score = 0;
  for (std::size_t candidates = 0; candidates < kCandidates;) {
    const std::optional<FastCorner> corner = fast_.take_strongest();
    if (!corner || (corner->score < kGoodScore && best_score >= kGoodScore)) break;
    if (!far_from_all(patch_centre(*corner), occupied_, min_distance_)) continue;
    ++candidates;
    TextureSums sums;
    pyramid.kernels().texture(image.origin + corner->v * image.stride + corner->u, image.stride, sums);
    const float strength = corner_strength(sums);
    if (strength < kMinStrength || strength <= best.strength) continue;
    if (!wider_than_noise(sums)) continue;
    best = {patch_centre(*corner), strength};
    best_score = corner->score;
  }
  return best.strength > 0.0F ? std::optional<Corner>(best) : std::nullopt;
}

const std::vector<Corner>& Detector::detect(const ImagePyramid& pyramid, const std::vector<Eigen::Vector2f>& taken,
                                            int wanted) {
  corners_.clear();
  occupied_ = taken;
  count_per_cell(taken);
  const std::size_t cells = count_.size();
  const auto enough = [&] { return static_cast<int>(corners_.size()) >= wanted; };
  for (int round = 0; round < kMaxPerCell && !enough(); ++round) {
    for (std::size_t k = 0; k < cells && !enough(); ++k) {
      const std::size_t cell = (next_ + k) % cells;
      if (count_[cell] != round) continue;
      const std::optional<Corner> corner = best_in_cell(pyramid, cell);
      if (!corner) continue;
      corners_.push_back(*corner);
      occupied_.push_back(corner->pixel);
      ++count_[cell];
    }
  }
  next_ = (next_ + cells / 3 + 1) % cells;
  return corners_;
}

}  // namespace ear
