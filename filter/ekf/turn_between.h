// The rotation between two directions. In a file of its own: what Eigen brings along for it is large to compile.
#pragma once

#include <Eigen/Core>

namespace ear {

/// The shortest turn that takes the direction of `a` to that of `b`; neither is zero.
[[nodiscard]] Eigen::Matrix3d turn_between(const Eigen::Vector3d& a, const Eigen::Vector3d& b);

}  // namespace ear
