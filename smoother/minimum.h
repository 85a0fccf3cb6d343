// The minimum of (1), and how well the newest frame is known there.
#pragma once

#include <Eigen/Core>
#include <optional>

#include "smoother/factor.h"
#include "smoother/terms.h"
#include "smoother/unknowns.h"

namespace ear::smoother {

/// Moves the unknowns, those of the features among them, to the minimum of the terms and the prior. False, and as
/// before, if that comes to nothing.
[[nodiscard]] bool minimise(const Factor& prior, const Terms& terms, Unknowns& unknowns);

/// Covariance of the newest frame and the calibration around the present values: of the filter's error vector, zero for
/// what is no unknown here. Nothing if it cannot be computed.
[[nodiscard]] std::optional<Eigen::MatrixXd> newest_covariance(const Factor& prior, const Terms& terms,
                                                               const Unknowns& unknowns);

}  // namespace ear::smoother
