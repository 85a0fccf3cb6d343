// Pictures are rendered in square tiles, row by row: what the parts of the renderer share.
#pragma once

#include <array>

namespace ear::simulator {

/// Edge of a tile [px].
inline constexpr int kTile = 16;
/// Inverse depth [1/m] below which a surface counts as infinitely far.
inline constexpr float kFlattest = 1e-3F;
/// Row::surface where nothing has been seen.
inline constexpr int kNothing = -1;

/// A row of pixels of one tile: their rays, and the nearest points found so far.
struct Row {
  using Values = std::array<float, kTile>;
  const float* x;  ///< the ray (x, y, 1) in the camera's frame, per pixel
  const float* y;
  Values inverse_depth;            ///< [1/m]
  Values a, b;                     ///< place on the surface [m]
  Values level;                    ///< of detail
  std::array<int, kTile> surface;  ///< whose texture it is

  void clear() {
    inverse_depth.fill(kFlattest);
    a.fill(0.0F);
    b.fill(0.0F);
    level.fill(0.0F);
    surface.fill(kNothing);
  }
};

/// A pixel's footprint on a surface has two axes. Texture detail follows neither the longer one, or grazing surfaces
/// would blur, nor the shorter: the sub-pictures average along both. Shares of the two; the larger counts.
inline constexpr float kMinorShare = 0.6F;
inline constexpr float kMajorShare = 1.0F / 3.5F;

}  // namespace ear::simulator
