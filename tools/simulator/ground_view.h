// The wavy ground as one camera sees it at one instant.
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <array>
#include <cstdint>
#include <vector>

#include "tools/simulator/ground_caster.h"
#include "tools/simulator/lanes.h"
#include "tools/simulator/rays.h"
#include "tools/simulator/terrain.h"
#include "tools/simulator/tile.h"

namespace ear::simulator {

/// Casts the lattice's rays, then serves pixels. Where the ground within a cell is simple enough, its pixels take their
/// depth from its nodes; elsewhere their own rays are cast.
class GroundView {
 public:
  /// The rays of one sub-picture. Even pixels' rays pass (right, down) [px] from their centres, odd ones' on the other
  /// side.
  struct Optics {
    const Lattice& lattice;
    const PixelRays& rays;
    int width, height;  // [px]
    float right, down;
    float focal;  // [px]
  };

  /// What is seen: `surface` is the ground's name in Row::surface. Ground beyond a depth of `farthest` [m] is not seen.
  struct Ground {
    const Terrain& terrain;
    Eigen::Vector2d size;  // of its texture [m]; it goes on beyond, mirrored at each border
    float pixels_per_metre;
    int surface;
    float farthest;
  };

  /// Lattice and rays must outlive the view.
  GroundView(const Ground& ground, const Optics& optics, const Eigen::Isometry3d& T_WC);

  /// If the ground fills a tile: the least inverse depth that it has there [1/m]. Otherwise 0.
  [[nodiscard]] float farthest_in(int left, int top) const;

  /// Sees the ground in a row of a tile, where it is nearer than what the row has seen so far. Rows must come from
  /// below: each ray starts where the one two pixels below has ended.
  void see(int left, int v, Row& row);

 private:
  using Pixels = Eigen::Array<float, kCell, 1>;  // a row of a cell

  enum class Kind : std::uint8_t { empty, simple, complex };
  // Inverse depth as a function of the ray, near a node: w_i + g_i . (d - d_i), the tangent plane's.
  struct Node {
    float inverse_depth = 0.0F;                     // w_i [1/m], 0: no ground
    float base = 0.0F, per_x = 0.0F, per_y = 0.0F;  // w_i - g_i . d_i / 2, g_i / 2
    float level = 0.0F;                             // of detail
  };
  // Where the lattice's rays have met the ground; one row of nodes.
  struct NodeHits {
    explicit NodeHits(std::size_t columns) : depth(columns), x(columns), y(columns), descent(columns) {}
    std::vector<float> depth, x, y;  // [m], x and y from the eye
    std::vector<float> descent;      // of the ray towards the ground, per metre over it
  };
  struct Seen {
    Lanes inverse_depth, level;
  };

  [[nodiscard]] RayLanes to_world(const float* x, const float* y) const;
  [[nodiscard]] Lanes level_of(const Lanes& depth, const Lanes& facing) const;
  void cast_nodes(int j, const NodeHits* lower, NodeHits& hits);
  [[nodiscard]] Kind kind_of(const NodeHits& upper, const NodeHits& lower, std::size_t i) const;
  void see_lanes(int left, int v, std::size_t at, Row& row);
  [[nodiscard]] Seen interpolate(int left, int v, const float* x, const float* y) const;
  [[nodiscard]] Seen cast(int left, int v, const RayLanes& rays);
  [[nodiscard]] float* kept_depth(int left, int v) {
    return depth_.data() + static_cast<std::size_t>(v % kRowsKept * optics_.width + left);
  }

  static constexpr int kRowsKept = 2 * kTile;

  Optics optics_;
  Eigen::Vector2f size_;  // of the texture [m]
  float pixels_per_metre_;
  int surface_;
  Eigen::Matrix3f R_WC_;
  GroundCaster caster_;
  std::array<std::array<Pixels, 4>, kCell> weights_;  // of the nodes, upper left to lower right, per row of a cell
  std::vector<Node> nodes_;
  std::vector<Kind> cells_;
  std::vector<float> depth_;  // of the rays of the last rows: kMissed if they miss, 0 if that is not known
};

}  // namespace ear::simulator
