#include "frontend/reference_patch.h"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>

namespace ear {
namespace {

constexpr int kCoarseSteps = 5;         // on each level above the base
constexpr float kCoarseSettled = 0.1F;  // [px of the level]
constexpr int kPositionSteps = 6;       // on the base level, before the affine map is freed
constexpr float kPositionSettled = 0.25F;
constexpr int kAffineSteps = 6;
constexpr float kAffineSettled = 0.02F;
constexpr float kMaxUnsettled = 0.1F;  // [px] a last step this long is still a match: noise keeps weak patches moving
// What further steps may still move the estimate by, squared, against its covariance. The estimate's own error is 6 in
// the mean, one for each parameter.
constexpr float kMaxLeft = 0.5F;
constexpr float kNearlySettled = 0.05F;  // [px] only after such a step: what does not fit the patch passes for noise
constexpr float kUsualRate = 0.5F;       // of a step to the one before, where there is none
constexpr float kMaxRate = 0.9F;
constexpr float kMinScale = 0.3F;    // of steps that overshoot
constexpr float kMaxStretch = 2.5F;  // of the affine map: beyond, the patch is no longer what it was

Warp scaled(const Warp& warp, int level) {
  const auto size = static_cast<float>(1 << level);
  return {warp.centre / size, warp.affine, warp.perspective * size};
}

// What a patch under this warp may read of a level.
const GreyLevel& level_under(const ImagePyramid& pyramid, int level, const Warp& warp, float half = kPatchHalf) {
  const float reach = warp.reach(half).y() + 1.0F;
  // Also of warps that make no sense: steps see that for themselves.
  const auto row = [](float at) { return static_cast<int>(std::min(1e5F, std::max(-1e4F, at))); };
  return pyramid.level(level, row(warp.centre.y() - reach) - 1, row(warp.centre.y() + reach) + 1);
}

bool plausible(const Eigen::Matrix2f& affine) {
  const float area = affine.determinant();
  return area > 1.0F / (kMaxStretch * kMaxStretch) && area < kMaxStretch * kMaxStretch &&
         affine.cwiseAbs().maxCoeff() < kMaxStretch;
}

// What is left after a step, squared, against the covariance: steps shrink at a constant rate.
float left_after(const PatchLevel::Step& step, const std::optional<PatchLevel::Step>& before) {
  const float rate = before ? std::min(std::sqrt(step.chi2 / before->chi2), kMaxRate) : kUsualRate;
  const float further = rate / (1.0F - rate);
  return step.chi2 * further * further;
}

// Steps until one is shorter than `short_enough`, or the rest would be lost in the noise, and returns the last. Where
// the image is sharper than the patch, steps overshoot: each then undoes a part of the one before, which shows how much
// shorter they should be.
template <class DoStep>
std::optional<PatchLevel::Step> settle(int max_steps, float short_enough, DoStep&& do_step) {
  float scale = 1.0F;
  std::optional<PatchLevel::Step> last;
  for (int i = 0; i < max_steps; ++i) {
    const std::optional<PatchLevel::Step> step = do_step(scale);
    if (!step) return std::nullopt;
    if (last) {
      const float ratio = step->moved.dot(last->moved) / last->moved.squaredNorm();
      if (ratio < 0.0F) scale = std::max(scale / (1.0F - ratio), kMinScale);
    }
    const float length2 = step->moved.squaredNorm();
    const bool lost_in_noise = length2 < kNearlySettled * kNearlySettled && left_after(*step, last) < kMaxLeft;
    last = step;
    if (length2 < short_enough * short_enough || lost_in_noise) break;
  }
  return last;
}

}  // namespace

bool ReferencePatch::capture(const ImagePyramid& pyramid, const Eigen::Vector2f& pixel) {
  usable_.fill(false);
  for (int level = 0; level <= pyramid.top_level(); ++level) {
    const auto i = static_cast<std::size_t>(level);
    const Warp upright{pixel / static_cast<float>(1 << level)};
    const GreyLevel& image = level_under(pyramid, level, upright, PatchLevel::kCaptured);
    usable_[i] = levels_[i].capture(pyramid.kernels(), image, upright.centre, level == 0);
  }
  return usable_.front();
}

std::optional<float> ReferencePatch::correlate(const ImagePyramid& pyramid, const Warp& warp, int level) const {
  const auto i = static_cast<std::size_t>(level);
  if (!usable_[i]) return std::nullopt;
  const Warp coarse = scaled(warp, level);
  return levels_[i].correlate(pyramid.kernels(), level_under(pyramid, level, coarse), coarse);
}

std::optional<std::array<float, kPatchSize>> ReferencePatch::correlate_along(const ImagePyramid& pyramid,
                                                                             const Warp& warp, int level) const {
  const auto i = static_cast<std::size_t>(level);
  if (!usable_[i]) return std::nullopt;
  const Warp coarse = scaled(warp, level);
  const float fall = std::abs(static_cast<float>(kPatchSize) * coarse.affine(1, 0));  // of the row
  return levels_[i].correlate_along(pyramid.kernels(), level_under(pyramid, level, coarse, kPatchHalf + fall), coarse);
}

std::optional<ReferencePatch::Match> ReferencePatch::align(const ImagePyramid& pyramid, const Warp& start,
                                                           int start_level) const {
  Warp warp = start;
  for (int level = std::min(start_level, pyramid.top_level()); level > 0; --level) {
    const auto i = static_cast<std::size_t>(level);
    if (!usable_[i]) continue;
    Warp coarse = scaled(warp, level);
    const auto settled = settle(kCoarseSteps, kCoarseSettled, [&](float scale) {
      return levels_[i].step_position(pyramid.kernels(), level_under(pyramid, level, coarse), scale, coarse);
    });
    if (settled) warp.centre = coarse.centre * static_cast<float>(1 << level);
  }

  const PatchLevel& base = levels_.front();
  const GreyLevel& image = pyramid.level(0);
  // A start on the base level is close enough for the full step.
  const auto placed = start_level == 0 ? std::optional<PatchLevel::Step>(PatchLevel::Step{})
                                       : settle(kPositionSteps, kPositionSettled, [&](float scale) {
                                           return base.step_position(pyramid.kernels(), image, scale, warp);
                                         });
  if (!placed) return std::nullopt;
  const auto settled = settle(kAffineSteps, kAffineSettled, [&](float scale) {
    return base.step_affine(pyramid.kernels(), image, start.affine, scale, warp);
  });
  if (!settled || !plausible(warp.affine)) return std::nullopt;
  if (settled->moved.norm() > kMaxUnsettled || settled->correlation < kMinCorrelation) return std::nullopt;
  return Match{warp, settled->correlation};
}

}  // namespace ear
