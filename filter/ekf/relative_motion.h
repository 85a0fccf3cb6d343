// How the body moved since a clone, as one measurement of the whole pose: where it stands still, and where the images
// of two frames show it by themselves. docs/filter.md, "Standing", "Gaps and jumps".
#pragma once

#include <Eigen/Core>

#include "filter/ekf/state.h"

namespace ear {

/// Rows in the axes of the world, not whitened: rotation [rad], position [m]. `H` is by the inertial part, `H_clone` by
/// the clone.
struct RelativeMotionRows {
  Eigen::Matrix<double, 6, err::imu_size> H = Eigen::Matrix<double, 6, err::imu_size>::Zero();
  Eigen::Matrix<double, 6, err::clone_size> H_clone = Eigen::Matrix<double, 6, err::clone_size>::Zero();
  Eigen::Matrix<double, 6, 1> residual = Eigen::Matrix<double, 6, 1>::Zero();
};

/// `T_B0B1`: the body now in the body of clone `i`, as measured.
[[nodiscard]] RelativeMotionRows linearize_relative_motion(const State& x, int i, const Pose& T_B0B1);

}  // namespace ear
