#include "frontend/reference_patch.h"

#include <Eigen/LU>
#include <algorithm>

namespace ear {
namespace {

constexpr int kCoarseSteps = 5;        // on each level above the base
constexpr float kCoarseSettled = 0.1F; // [px of the level]
constexpr int kPositionSteps = 6;      // on the base level, before the affine map is freed
constexpr float kPositionSettled = 0.25F;
constexpr int kAffineSteps = 6;
constexpr float kAffineSettled = 0.015F;
constexpr float kMaxUnsettled = 0.15F;  // [px] a last step this long is still a match: noise keeps weak patches moving
constexpr float kMaxStretch = 2.5F;  // of the affine map: beyond, the patch is no longer what it was

Warp scaled(const Warp& warp, int level) { return {warp.centre / static_cast<float>(1 << level), warp.affine}; }

bool plausible(const Eigen::Matrix2f& affine) {
  const float area = affine.determinant();
  return area > 1.0F / (kMaxStretch * kMaxStretch) && area < kMaxStretch * kMaxStretch &&
         affine.cwiseAbs().maxCoeff() < kMaxStretch;
}

}  // namespace

bool ReferencePatch::capture(const ImagePyramid& pyramid, const Eigen::Vector2f& pixel) {
  usable_.fill(false);
  for (int level = 0; level <= pyramid.top_level(); ++level) {
    const auto i = static_cast<std::size_t>(level);
    usable_[i] = levels_[i].capture(pyramid.level(level), pixel / static_cast<float>(1 << level));
  }
  return usable_.front();
}

std::optional<float> ReferencePatch::correlate(const ImagePyramid& pyramid, const Warp& warp, int level) const {
  const auto i = static_cast<std::size_t>(level);
  if (!usable_[i]) return std::nullopt;
  return levels_[i].correlate(pyramid.level(level), scaled(warp, level));
}

std::optional<ReferencePatch::Match> ReferencePatch::align(const ImagePyramid& pyramid, const Warp& start,
                                                           int start_level) const {
  Warp warp = start;
  for (int level = std::min(start_level, pyramid.top_level()); level > 0; --level) {
    const auto i = static_cast<std::size_t>(level);
    if (!usable_[i]) continue;
    Warp coarse = scaled(warp, level);
    bool found = true;
    for (int step = 0; step < kCoarseSteps && found; ++step) {
      const auto done = levels_[i].step_position(pyramid.level(level), coarse);
      found = done.has_value();
      if (found && done->moved < kCoarseSettled) break;
    }
    if (found) warp.centre = coarse.centre * static_cast<float>(1 << level);
  }

  const PatchLevel& base = levels_.front();
  const GreyLevel& image = pyramid.level(0);
  for (int step = 0; step < kPositionSteps; ++step) {
    const auto done = base.step_position(image, warp);
    if (!done) return std::nullopt;
    if (done->moved < kPositionSettled) break;
  }
  PatchLevel::Step last;
  for (int step = 0; step < kAffineSteps; ++step) {
    const auto done = base.step_affine(image, start.affine, warp);
    if (!done || !plausible(warp.affine)) return std::nullopt;
    last = *done;
    if (last.moved < kAffineSettled) break;
  }
  if (last.moved > kMaxUnsettled || last.correlation < kMinCorrelation) return std::nullopt;
  return Match{warp, last.correlation};
}

}  // namespace ear
