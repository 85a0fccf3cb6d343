// Where a camera of the vehicle is.
#pragma once

#include <Eigen/Geometry>

#include "tools/simulator/trajectory.h"

namespace ear::simulator {

/// T_WC of a camera at T_BC in a body that moves like this.
[[nodiscard]] inline Eigen::Isometry3d camera_pose(const Kinematics& motion, const Eigen::Isometry3d& T_BC) {
  Eigen::Isometry3d T_WB = Eigen::Isometry3d::Identity();
  T_WB.linear() = motion.R_WB;
  T_WB.translation() = motion.p_WB;
  return T_WB * T_BC;
}

}  // namespace ear::simulator
