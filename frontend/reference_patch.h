// A feature's appearance on all pyramid levels, and how it is found again: from coarse to fine, position first, then
// the affine map as well.
#pragma once

#include <Eigen/Core>
#include <array>
#include <optional>

#include "frontend/image_pyramid.h"
#include "frontend/patch.h"

namespace ear {

class ReferencePatch {
 public:
  /// Takes the patch around `pixel` of the base image. False if the base level is unusable; a coarser level that is
  /// will be skipped when aligning.
  bool capture(const ImagePyramid& pyramid, const Eigen::Vector2f& pixel);

  struct Match {
    Warp warp;                  ///< in pixels of the base image
    float correlation = -1.0F;  ///< zero-mean normalized, on the base level
  };

  /// Aligns the patch with an image, beginning at `start` on level `start_level`. Nothing if it leaves the image, does
  /// not settle, or looks different there (correlation below kMinCorrelation).
  [[nodiscard]] std::optional<Match> align(const ImagePyramid& pyramid, const Warp& start, int start_level) const;

  /// See PatchLevel::correlate, on one level at a fixed place; nothing if the level is unusable or the patch leaves it.
  [[nodiscard]] std::optional<float> correlate(const ImagePyramid& pyramid, const Warp& warp, int level) const;

  /// See PatchLevel::correlate_along, likewise.
  [[nodiscard]] std::optional<std::array<float, kPatchSize>> correlate_along(const ImagePyramid& pyramid,
                                                                             const Warp& warp, int level) const;

  /// See PatchLevel::corner_strength, base level.
  [[nodiscard]] float corner_strength() const { return levels_.front().corner_strength(); }

  static constexpr float kMinCorrelation = 0.75F;

 private:
  std::array<PatchLevel, ImagePyramid::kMaxLevels> levels_;
  std::array<bool, ImagePyramid::kMaxLevels> usable_{};
};

}  // namespace ear
