// What the drives show of the parameters: their covariance, with everything else eliminated.
#pragma once

#include <Eigen/Core>
#include <optional>

#include "calibration/batch.h"

namespace ear::calibration {

/// Covariance of all parameters at the present values, in the order of Batch::parameter_blocks(), priors included.
/// Nothing if the problem is singular.
[[nodiscard]] std::optional<Eigen::MatrixXd> parameter_covariance(Batch& batch, int threads);

}  // namespace ear::calibration
