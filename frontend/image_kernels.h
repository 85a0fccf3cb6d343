// The arithmetic of images and patches, once for each vector unit: one program holds them all, and takes the best one
// that the processor has. All variants give the same bits: pixels are interpolated and multiplied in whole numbers,
// what is float is added up in eight columns and in the same order, and no product is fused with a sum.
// docs/performance.md, "Kernels".
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "ear/frontend_config.h"
#include "frontend/grey_level.h"

namespace ear {

constexpr int kPatchSize = 16;
constexpr int kPatchPixels = kPatchSize * kPatchSize;
constexpr float kPatchHalf = 0.5F * (kPatchSize - 1);

/// ear::Warp in plain numbers: an offset o from the patch's centre is seen at centre + A o (1 - perspective . o).
struct PatchPlace {
  std::array<float, 2> centre;
  std::array<float, 2> column_x, column_y;  ///< of A
  std::array<float, 2> perspective;
};

constexpr float kPatchUnit = 1.0F / 16.0F;    // [grey values] of a patch's pixels
constexpr float kGradientUnit = 1.0F / 8.0F;  // [grey values / px]

/// A patch, row by row. Offsets of its pixels from the centre are -7.5, -6.5, ... 7.5.
struct PatchPixels {
  alignas(32) std::array<std::int16_t, kPatchPixels> value;                   ///< mean removed, in kPatchUnit
  alignas(32) std::array<std::int16_t, kPatchPixels> gradient_x, gradient_y;  ///< in kGradientUnit
  float mean;                                                                 ///< [grey values]
};

/// Sums over a patch of the image under it (less the patch's mean), and of its products with the patch and its
/// gradients; x_y: the gradient in x times the offset in y, and so on.
struct AlignmentSums {
  float image, image2, product;
  float x, y;
  float x_x, x_y, y_x, y_y;  ///< not of align_position()
};

/// Sums of one quantity times 1, x, y, x^2, x y, y^2, with the offsets of each pixel.
struct Moments {
  float one, x, y, xx, xy, yy;
};

/// Of a patch's gradients and values: what its normal equations are made of.
struct PatchMoments {
  Moments gx_gx, gx_gy, gy_gy;
  Moments gx, gy, gx_value, gy_value;  ///< the first three of each
  float energy;                        ///< sum of value^2
  float middle, middle2;               ///< sums of value and value^2 over the middle eight rows
};

/// Sums over the 15x15 pixels around one: of squared differences between the neighbours on both sides, of the product
/// of the two, and of squared differences to the next pixel.
struct TextureSums {
  int across2, down2, across_down;
  int right2, below2;
};

/// Whoever calls has checked that the patch lies inside of the level with its border, and that a row more above, two
/// below, and kReadBehind bytes behind them may be read.
constexpr int kReadBehind = 32;

struct ImageKernels {
  Kernels kind;
  void (*align_position)(const GreyLevel& level, const PatchPlace& place, const PatchPixels& patch,
                         AlignmentSums& sums);
  void (*align_affine)(const GreyLevel& level, const PatchPlace& place, const PatchPixels& patch, AlignmentSums& sums);
  /// image, image2 and product over the middle eight rows.
  void (*compare)(const GreyLevel& level, const PatchPlace& place, const PatchPixels& patch, AlignmentSums& sums);
  /// What compare() gives at sixteen places: the patch's centre there, and one column of it further each time.
  void (*compare_along)(const GreyLevel& level, const PatchPlace& place, const PatchPixels& patch,
                        std::array<AlignmentSums, kPatchSize>& sums);
  /// Takes the upright patch around `centre`; reads two more pixels on each side.
  void (*capture)(const GreyLevel& level, const std::array<float, 2>& centre, PatchPixels& patch);
  void (*moments)(const PatchPixels& patch, PatchMoments& moments);
  /// Without those that have an offset: the first of each.
  void (*position_moments)(const PatchPixels& patch, PatchMoments& moments);
  /// FAST's score of `width` pixels of a row, 0 where there is none, and perhaps where it is below `threshold`; three
  /// pixels around are read, and up to 31 more than `width` are looked at and written.
  void (*corner_scores)(const std::uint8_t* row, std::ptrdiff_t stride, int width, int threshold, std::uint8_t* scores);
  void (*texture)(const std::uint8_t* middle, std::ptrdiff_t stride, TextureSums& sums);
  /// `rows` rows of an image half as large: `width` pixels, each 1/256 (1 4 6 4 1) (1 4 6 4 1)^T around every second
  /// pixel of every second row, rounded; the first is around `middle`. Of the rows from 2 above that to 2 `rows` below,
  /// columns from -2 to 2 width + 1 and up to 30 more are read; up to 15 more pixels than `width` are written.
  void (*halve)(const std::uint8_t* middle, std::ptrdiff_t stride, int width, int rows, std::uint8_t* out,
                std::ptrdiff_t out_stride);
};

/// Those that this build has and this processor can run, the best one last.
[[nodiscard]] std::vector<ImageKernels> image_kernels();

/// Throws std::invalid_argument where this processor, or this build, does not have them.
[[nodiscard]] ImageKernels image_kernels(Kernels kind);

[[nodiscard]] std::string name_of(Kernels kind);

/// Throws std::invalid_argument, naming those that there are.
[[nodiscard]] Kernels kernels_named(const std::string& name);

}  // namespace ear
