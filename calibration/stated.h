// A calibration with what is known of its values, as sensor.yaml states it.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "calibration/calibrate.h"

namespace ear::calibration {

/// `calibration` with the standard deviations of the findings, in the places where the filter looks for them.
[[nodiscard]] Calibration with_sigmas(Calibration calibration, const std::vector<Finding>& findings);

/// Root mean square of the standard deviations of all entries whose name begins so, in their unit. Nothing where there
/// is none.
[[nodiscard]] std::optional<double> mean_sigma(const std::vector<Finding>& findings, const std::string& name);

}  // namespace ear::calibration
