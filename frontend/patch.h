// The appearance of a feature, and its alignment with an image: inverse-compositional Lucas-Kanade under an affine warp
// (Baker and Matthews 2004), blind to gain and offset of the brightness.
//
// All gradients belong to the stored patch, so that an iteration only samples the image and adds up products.
#pragma once

#include <Eigen/Core>
#include <array>
#include <limits>
#include <optional>

#include "frontend/grey_level.h"
#include "frontend/image_kernels.h"

namespace ear {

/// Where a patch lies in an image: an offset o from its centre is seen at centre + affine o / (1 + perspective . o), as
/// two cameras see a plane. Only centre and affine map are ever estimated; the perspective is known from the motion.
struct Warp {
  Eigen::Vector2f centre = Eigen::Vector2f::Zero();       ///< [px]
  Eigen::Matrix2f affine = Eigen::Matrix2f::Identity();   ///< patch offset to image offset, at the centre
  Eigen::Vector2f perspective = Eigen::Vector2f::Zero();  ///< how the scale shrinks along the patch [1/px]

  /// How far from the centre offsets of up to `half` are seen, at most [px].
  [[nodiscard]] Eigen::Vector2f reach(float half) const {
    const float widest = 1.0F + half * perspective.cwiseAbs().sum();
    return half * widest * affine.cwiseAbs().rowwise().sum();
  }
};

/// A patch at one level of a pyramid. All variants of the kernels give the same bits.
class PatchLevel {
 public:
  /// Takes the patch around `centre` [px of this level]. False if it reaches outside the level's border or has no
  /// texture in one direction; the patch is then unusable. `affine`: also for steps of the affine map.
  bool capture(const ImageKernels& kernels, const GreyLevel& level, const Eigen::Vector2f& centre, bool affine = true);

  static constexpr float kCaptured = kPatchHalf + 2.0F;  ///< [px] from the centre, with the derivative's reach

  /// Smaller eigenvalue of the patch's structure matrix [grey^2]: the variance of the image noise divided by it is the
  /// variance of the patch's position along the direction that it sees worst [px^2].
  [[nodiscard]] float corner_strength() const { return corner_strength_; }

  struct Step {
    float correlation = -1.0F;                        ///< zero-mean normalized *before* the step, -1 to 1
    Eigen::Vector2f moved = Eigen::Vector2f::Zero();  ///< of the centre [px of this level]
    /// How far it led, squared, against the covariance of what it estimates (chi-square). That comes from what the
    /// patch and the image differ by after the step; infinite where this is nothing.
    float chi2 = std::numeric_limits<float>::infinity();
  };

  /// One Gauss-Newton step of the position, `scale` times as long; nothing if the patch leaves the image or does not
  /// correlate with it.
  [[nodiscard]] std::optional<Step> step_position(const ImageKernels& kernels, const GreyLevel& level, float scale,
                                                  Warp& warp) const;

  /// One Gauss-Newton step of position and affine map. The map is held near `prior`, so that a patch which does
  /// not show some direction of it (an edge) keeps what is known.
  [[nodiscard]] std::optional<Step> step_affine(const ImageKernels& kernels, const GreyLevel& level,
                                                const Eigen::Matrix2f& prior, float scale, Warp& warp) const;

  /// Zero-mean normalized correlation of every second row with the image, to compare places; nothing if the patch
  /// leaves the image.
  [[nodiscard]] std::optional<float> correlate(const ImageKernels& kernels, const GreyLevel& level,
                                               const Warp& warp) const;

  /// correlate() at sixteen places: `warp`'s centre, and one column of the patch further each time, without its
  /// perspective. Nothing if the patch leaves the image at one of them, or the perspective matters.
  [[nodiscard]] std::optional<std::array<float, kPatchSize>> correlate_along(const ImageKernels& kernels,
                                                                             const GreyLevel& level,
                                                                             const Warp& warp) const;

 private:
  [[nodiscard]] float correlation(const AlignmentSums& sums) const;  // over the rows that correlate() compares

  using Vector6f = Eigen::Matrix<float, 6, 1>;
  using Matrix6f = Eigen::Matrix<float, 6, 6>;

  // Fills everything below from the pixels. False if the patch has no texture in one direction.
  bool solve_normal_equations(const ImageKernels& kernels, bool affine);

  // Order of the parameters: position x, y; affine xx, xy, yx, yy.
  PatchPixels pixels_;
  float energy_ = 0.0F;           // sum of value^2
  float middle_ = 0.0F;           // sums over the rows that correlate() compares: value
  float middle_variance_ = 0.0F;  // and its square, less the mean
  float corner_strength_ = 0.0F;
  Vector6f J_sum_;    // J^T 1
  Vector6f J_value_;  // J^T value
  Eigen::Matrix2f covariance_position_;
  Matrix6f covariance_affine_;
};

}  // namespace ear
