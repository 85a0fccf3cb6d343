// Eigen's matrices as the kernels take them.
#pragma once

#include <Eigen/Core>

#include "filter/kernels/filter_kernels.h"

namespace ear {

[[nodiscard]] inline ConstMatrix readable(const Eigen::MatrixXd& M) { return {M.data(), M.outerStride()}; }
[[nodiscard]] inline MutableMatrix writable(Eigen::MatrixXd& M) { return {M.data(), M.outerStride()}; }

}  // namespace ear
