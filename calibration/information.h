// What the drives show of the parameters: their covariance, with everything else eliminated.
#pragma once

#include <Eigen/Core>
#include <optional>

#include "calibration/batch.h"
#include "calibration/findings.h"

namespace ear::calibration {

/// What is known of all parameters at the present values, in the order of Batch::parameter_blocks(), priors included.
struct Information {
  Covariances covariances;  ///< as found: of a feature's sightings, of any size, and alike over its whole track
  /// How much larger the features make a standard deviation than errors would that are white and of the noise assumed:
  /// root of the mean over the parameters, as far as features show them. 1 where there are none.
  double lasting = 1.0;
};

/// docs/calibration.md has the derivation. Nothing if the problem is singular.
[[nodiscard]] std::optional<Information> information_of(Batch& batch, int threads);

}  // namespace ear::calibration
