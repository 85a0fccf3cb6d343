// The panels as one camera sees them at one instant.
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <array>
#include <vector>

#include "tools/simulator/scene.h"
#include "tools/simulator/texture.h"
#include "tools/simulator/tile.h"

namespace ear::simulator {

/// Bounds of the rays of one tile.
struct RayBox {
  float min_x, max_x, min_y, max_y;
};

/// A panel in the camera's frame. For the ray d = (x, y, 1): inverse depth w = m . d, place on the panel a = a0 + u . d
/// / w.
struct PanelView {
  Eigen::Vector3f m, u, v;
  float a0 = 0.0F, b0 = 0.0F, width = 0.0F, height = 0.0F;
  std::array<Eigen::Vector3f, 4> corners;
  int surface = kNothing;
  float pixels_per_metre = 0.0F;  // of its texture
};

/// `surface`: what Row::surface calls the panel.
[[nodiscard]] PanelView view_of(const Panel& panel, int surface, const Texture& texture, const Eigen::Isometry3d& T_WC);

/// What one tile sees of one panel.
struct PanelPart {
  const PanelView* view = nullptr;
  float nearest = 0.0F;          ///< largest inverse depth of its plane over the tile [1/m]
  float farthest = 0.0F;         ///< smallest
  bool covers = false;           ///< all of the tile
  std::array<float, 4> level{};  ///< of detail, at the tile's corners
};

/// The panels that one tile may see, without those behind a panel that fills the tile, or farther than an inverse depth
/// of `wall` [1/m]. focal: [px].
void find_panels(const std::vector<PanelView>& views, const RayBox& box, float focal, float wall,
                 std::vector<PanelPart>& found);

/// Sees nothing but this panel, which covers the tile. `row` needs nothing but its rays.
void see_only(const PanelPart& panel, const RayBox& box, Row& row);

/// Sees this panel where it is nearer than what the row has seen so far.
void see_nearest(const PanelPart& panel, const RayBox& box, Row& row);

}  // namespace ear::simulator
