// What the inertial samples add up to from the first moment of a start in motion on, with its derivatives by the
// biases.
#pragma once

#include <Eigen/Core>

#include "filter/ekf/so3.h"

namespace ear {

/// In the body frame B of the first moment; f is the specific force, and both biases are taken off before.
struct StartSums {
  Eigen::Matrix3d R = Eigen::Matrix3d::Identity();     ///< rotation to B
  Eigen::Vector3d velocity = Eigen::Vector3d::Zero();  ///< integral of R f [m/s]
  Eigen::Vector3d position = Eigen::Vector3d::Zero();  ///< its integral [m]
  Eigen::Matrix3d R_by_b_g = Eigen::Matrix3d::Zero();  ///< of the turn in B: -integral of R [s]
  Eigen::Matrix3d velocity_by_b_g = Eigen::Matrix3d::Zero();
  Eigen::Matrix3d position_by_b_g = Eigen::Matrix3d::Zero();
  Eigen::Matrix3d position_by_b_a = Eigen::Matrix3d::Zero();

  [[nodiscard]] const Eigen::Matrix3d& velocity_by_b_a() const { return R_by_b_g; }

  void add(const Eigen::Vector3d& rate_B, const Eigen::Vector3d& accel_B, double dt) {
    const Eigen::Matrix3d middle = R * exp_so3(0.5 * dt * rate_B);
    const Eigen::Vector3d force = middle * accel_B;
    position += dt * velocity + 0.5 * dt * dt * force;
    velocity += dt * force;
    position_by_b_a += dt * R_by_b_g - 0.5 * dt * dt * middle;
    R_by_b_g -= 0.5 * dt * middle;
    const Eigen::Matrix3d force_by_b_g = -skew(force) * R_by_b_g;
    position_by_b_g += dt * velocity_by_b_g + 0.5 * dt * dt * force_by_b_g;
    velocity_by_b_g += dt * force_by_b_g;
    R_by_b_g -= 0.5 * dt * middle;
    R = R * exp_so3(dt * rate_B);
  }
};

}  // namespace ear
