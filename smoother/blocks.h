// The unknowns as Ceres sees them: blocks of doubles, and how a step of the solver changes each.
//
//   pose    (7) q_x q_y q_z q_w p_x p_y p_z   step (6): R = Exp(theta) R^, p = p^ + dp; body in the world, camera 0 in
//                                             the body, camera 1 in camera 0
//   motion  (9) v_W b_g b_a                   additive
//   imaging (7) of both cameras: focal length and principal point (LensError); camera stamp to IMU time [s]; additive
//   wheels  (6) relative error of the radii (left, right) and of the track width, turn of the odometer [rad]; of the
//               calibration that was given    additive
//   point   (3) alpha, beta, inverse depth    additive; in a camera frame that stays where it is in the world
#pragma once

#include <ceres/manifold.h>

#include <Eigen/Geometry>
#include <array>

#include "filter/ekf/state.h"

namespace ear::smoother {

using PoseBlock = std::array<double, 7>;
using MotionBlock = std::array<double, 9>;
using ImagingBlock = std::array<double, 7>;
using WheelBlock = std::array<double, 6>;
using PointBlock = std::array<double, 3>;

inline constexpr int kPoseStep = 6;
inline constexpr int kMotionStep = 9;

namespace motion_entry {
inline constexpr int v = 0, b_g = 3, b_a = 6;
}
namespace imaging_entry {
inline constexpr int lens = 0, time_offset = 6;
}
namespace wheel_entry {
inline constexpr int radius = 0, track_width = 2, turn = 3;
}

[[nodiscard]] inline Pose to_pose(const double* block) {
  return {Eigen::Map<const Eigen::Quaterniond>(block).normalized().toRotationMatrix(),
          Eigen::Map<const Eigen::Vector3d>(block + 4)};
}

/// The cameras' lenses and time offset; their poses are blocks of their own.
void set_imaging(const double* block, CameraState& cameras);
[[nodiscard]] ImagingBlock imaging_block(const CameraState& cameras);

[[nodiscard]] inline PoseBlock to_block(const Pose& pose) {
  PoseBlock block;
  Eigen::Map<Eigen::Quaterniond>(block.data()) = Eigen::Quaterniond(pose.R).normalized();
  Eigen::Map<Eigen::Vector3d>(block.data() + 4) = pose.p;
  return block;
}

/// The step of pose blocks. Cost functions give their derivatives by the step itself, in the first six columns, and
/// zeros in the seventh: what Ceres multiplies them with is (I; 0). Only they know of it.
class PoseManifold final : public ceres::Manifold {
 public:
  [[nodiscard]] int AmbientSize() const override { return 7; }
  [[nodiscard]] int TangentSize() const override { return kPoseStep; }
  bool Plus(const double* x, const double* step, double* result) const override;
  bool PlusJacobian(const double* x, double* jacobian) const override;
  bool Minus(const double* y, const double* x, double* step) const override;
  bool MinusJacobian(const double* x, double* jacobian) const override;
};

/// Inverse of the left Jacobian of SO(3): Log(Exp(d) Exp(phi)) = phi + J d + ...
[[nodiscard]] inline Eigen::Matrix3d left_jacobian_inverse(const Eigen::Vector3d& phi) {
  return gamma<1>(phi).inverse();
}

}  // namespace ear::smoother
