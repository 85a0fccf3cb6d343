#include "tools/simulator/wheel_contact.h"

#include <Eigen/Geometry>
#include <Eigen/LU>
#include <cmath>

namespace ear::simulator {
namespace {

struct RimPoint {
  Eigen::Vector3d p_W;
  double depth;
};

// The rim's deepest point. With alpha the angle from the disc's lowest point, depth(alpha) = h(q) - q_z is smooth and,
// as the ground curves less than the disc, has one maximum: Newton with a finite-difference second derivative.
RimPoint deepest_point(const Terrain& terrain, const Eigen::Vector3d& centre_W, const Eigen::Vector3d& axle_W,
                       double radius) {
  const Eigen::Vector3d forward_W = Eigen::Vector3d(axle_W.y(), -axle_W.x(), 0.0).normalized();
  const Eigen::Vector3d down_W = axle_W.cross(forward_W);  // y x x = -z
  const auto rim = [&](double alpha) -> Eigen::Vector3d {
    return centre_W + radius * (std::sin(alpha) * forward_W + std::cos(alpha) * down_W);
  };
  const auto depth_slope = [&](double alpha) {
    const Eigen::Vector3d q_W = rim(alpha);
    const Eigen::Vector3d dq_W = radius * (std::cos(alpha) * forward_W - std::sin(alpha) * down_W);
    return terrain.gradient(q_W.x(), q_W.y()).dot(dq_W.head<2>()) - dq_W.z();
  };
  double alpha = 0.0;
  if (!terrain.flat()) {
    constexpr double kStep = 1e-4;
    for (int i = 0; i < 6; ++i) {
      const double slope = depth_slope(alpha);
      const double curvature = (depth_slope(alpha + kStep) - slope) / kStep;
      const double step = -slope / curvature;
      alpha += step;
      if (std::abs(step) < 1e-7) break;
    }
  }
  const Eigen::Vector3d q_W = rim(alpha);
  return {q_W, terrain.height(q_W.x(), q_W.y()) - q_W.z()};
}

}  // namespace

Eigen::Vector3d axle_direction(double yaw, double roll) {
  return {-std::sin(yaw) * std::cos(roll), std::cos(yaw) * std::cos(roll), std::sin(roll)};
}

double disc_penetration(const Terrain& terrain, const Eigen::Vector3d& centre_W, const Eigen::Vector3d& axle_W,
                        double radius) {
  return deepest_point(terrain, centre_W, axle_W, radius).depth;
}

AxlePose rest_on_ground(const Terrain& terrain, const AxleGeometry& axle, double x, double y, double yaw,
                        const AxlePose& guess) {
  const double half = 0.5 * axle.track_width;
  AxlePose pose = guess;
  for (int i = 0; i < 10; ++i) {
    const Eigen::Vector3d axle_W = axle_direction(yaw, pose.roll);
    const Eigen::Vector3d middle_W(x, y, pose.height);
    // The discs' depths and their derivatives: at the deepest point, only the rim point's own motion counts.
    Eigen::Vector2d depth;
    Eigen::Matrix2d J_depth_pose;
    for (int wheel = 0; wheel < 2; ++wheel) {
      const double side = wheel == 0 ? half : -half;
      const RimPoint point =
          deepest_point(terrain, middle_W + side * axle_W, axle_W, axle.wheel_radius[static_cast<std::size_t>(wheel)]);
      const Eigen::Vector2d slope = terrain.gradient(point.p_W.x(), point.p_W.y());
      // A roll turns the rim point about the heading through the axle's middle.
      const Eigen::Vector3d heading_W(std::cos(yaw), std::sin(yaw), 0.0);
      const Eigen::Vector3d dp_W = heading_W.cross(point.p_W - middle_W);
      depth(wheel) = point.depth;
      J_depth_pose(wheel, 0) = -1.0;
      J_depth_pose(wheel, 1) = slope.dot(dp_W.head<2>()) - dp_W.z();
    }
    const Eigen::Vector2d step = -J_depth_pose.inverse() * depth;
    pose.height += step(0);
    pose.roll += step(1);
    if (step.cwiseAbs().maxCoeff() < 1e-11) break;
  }
  return pose;
}

}  // namespace ear::simulator
