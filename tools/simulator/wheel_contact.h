// How two wheels rest on the ground: height and roll of the axle.
#pragma once

#include <Eigen/Core>
#include <array>

#include "tools/simulator/terrain.h"

namespace ear::simulator {

/// The wheels are thin discs, perpendicular to the axle.
struct AxleGeometry {
  std::array<double, 2> wheel_radius{};  ///< left, right [m]
  double track_width = 0.0;              ///< [m]
};

/// Unit vector along the axle, to the left, at this yaw and roll.
[[nodiscard]] Eigen::Vector3d axle_direction(double yaw, double roll);

/// Depth [m] of the disc's deepest point under the ground; negative when the disc is above it.
[[nodiscard]] double disc_penetration(const Terrain& terrain, const Eigen::Vector3d& centre_W,
                                      const Eigen::Vector3d& axle_W, double radius);

struct AxlePose {
  double height = 0.0;  ///< z of the axle's middle [m]
  double roll = 0.0;    ///< about the heading [rad]
};

/// Where the axle rests when its middle is above (x, y): both discs touch the ground (to 1e-9 m) and penetrate nowhere.
/// `guess` is a pose nearby.
[[nodiscard]] AxlePose rest_on_ground(const Terrain& terrain, const AxleGeometry& axle, double x, double y, double yaw,
                                      const AxlePose& guess);

}  // namespace ear::simulator
