// How the body moved since the newest clone, as one measurement of the whole pose: where it stands still, and where the
// images of two frames show it by themselves. docs/filter.md, "Standing", "Gaps and jumps".
#pragma once

#include <Eigen/Core>

#include "filter/ekf/state.h"

namespace ear {

/// Rows of where the body is in the clone, in the axes of the world, not whitened: rotation [rad], position [m].
/// `T_B0B1`: the body now in the body of the newest clone, as measured. `H`: by the whole error vector.
void linearize_relative_motion(const State& x, const Pose& T_B0B1, Eigen::Ref<Eigen::MatrixXd> H,
                               Eigen::Ref<Eigen::Matrix<double, 6, 1>> residual);

}  // namespace ear
