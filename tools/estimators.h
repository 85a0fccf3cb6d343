// Estimators by name: the filter, and what it is compared with where that was built.
#pragma once

#include <string>
#include <vector>

#include "src/odometry_factory.h"

namespace ear::tools {

/// "filter", and "smoother" where Ceres was found.
[[nodiscard]] std::vector<std::string> estimator_names();

/// Throws std::invalid_argument for another name.
[[nodiscard]] MakeEstimator estimator_named(const std::string& name);

}  // namespace ear::tools
