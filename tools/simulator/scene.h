// The room around the vehicle: flat panels on and above the ground. Seen by the tracks and by the renderer.
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <optional>
#include <vector>

#include "tools/simulator/sequence.h"
#include "tools/simulator/terrain.h"

namespace ear::simulator {

/// What a panel looks like (texture.h).
enum class Material {
  floor,
  wall,
  brick,
  ceiling,
  wood,
  cardboard,
  poster,
  shelf,
  concrete,
  metal,
  grass,
  gravel,
  foliage,
  facade,
  sky
};

/// A one-sided rectangle: corner + a u + b v with 0 <= a <= width, 0 <= b <= height; seen from where its normal points.
struct Panel {
  Eigen::Vector3d corner_W;
  Eigen::Vector3d u_W, v_W;          ///< unit vectors
  double width = 0.0, height = 0.0;  ///< [m]
  Material material = Material::wall;
  Eigen::Vector3d normal_W = u_W.cross(v_W);
  double offset = normal_W.dot(corner_W);  ///< of the plane along its normal [m]

  /// Whether a point of the panel's plane lies within the panel.
  [[nodiscard]] bool contains(const Eigen::Vector3d& p_W) const {
    const double a = (p_W - corner_W).dot(u_W);
    const double b = (p_W - corner_W).dot(v_W);
    return a >= 0.0 && b >= 0.0 && a <= width && b <= height;
  }
};

struct Hit {
  double range = 0.0;  ///< along the unit direction [m]
  int panel = 0;       ///< index, or kGround
};

/// Hit::panel of the ground.
inline constexpr int kGround = -1;

struct Scene {
  Terrain terrain;
  std::vector<Panel> panels;
  /// Of the ground, from (0, 0) [m]; outdoors it goes on, mirrored at each border.
  Eigen::Vector2d size = Eigen::Vector2d::Zero();
  Material ground = Material::floor;

  /// The first surface that a ray (unit direction) meets.
  [[nodiscard]] std::optional<Hit> cast(const Eigen::Vector3d& origin_W, const Eigen::Vector3d& direction_W) const;

  /// Nothing stands between the two points (1 mm short of the second).
  [[nodiscard]] bool sees(const Eigen::Vector3d& from_W, const Eigen::Vector3d& to_W) const;
};

/// Outdoors: the ground with bushes, trees and houses at some distance, under a clouded sky.
[[nodiscard]] Scene make_outdoors(Place place, const Terrain& terrain);

/// The indoor room: 12 x 9 x 3.5 m with boxes, shelves, pillars and posters.
[[nodiscard]] Scene make_room(const Terrain& terrain);

/// Footprints of what stands on the floor of that room: (min x, min y, max x, max y) [m]. Paths keep away from them.
[[nodiscard]] std::vector<Eigen::Vector4d> room_footprints();

}  // namespace ear::simulator
