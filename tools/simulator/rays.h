// Rays through a lens, one per pixel or per node of a lattice, in the camera's frame.
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <vector>

#include "ear/calibration.h"
#include "tools/simulator/tile.h"

namespace ear::simulator {

/// One ray (x, y, 1) per pixel, tile by tile as the renderer wants them.
struct PixelRays {
  int width = 0;  ///< of the picture [px]
  std::vector<float> x, y;

  /// Of pixel (u, v). The pixels of a row of one tile follow each other.
  [[nodiscard]] std::size_t index(int u, int v) const {
    const int tile = v / kTile * (width / kTile) + u / kTile;
    return static_cast<std::size_t>((tile * kTile + v % kTile) * kTile + u % kTile);
  }
};

/// Even pixels' rays (u + v) pass at this offset [px] from their centres, odd ones' on the other side. Width and height
/// must be multiples of kTile.
[[nodiscard]] PixelRays make_rays(const CameraCalibration& camera, const Eigen::Vector2d& offset);

/// A lattice cuts the picture into cells of kCell x kCell pixels; its nodes are the cells' corners.
inline constexpr int kCell = 4;

/// Rays (x, y, 1) through the nodes, row by row. Node (i, j) stands between the pixels, at (kCell i - 1/2, kCell j -
/// 1/2).
struct Lattice {
  int columns = 0, rows = 0;  ///< of nodes; `columns` is rounded up to a multiple of kLanes
  std::vector<float> x, y;
};

[[nodiscard]] Lattice make_lattice(const CameraCalibration& camera);

}  // namespace ear::simulator
