// A calibration with what is known of its values, as sensor.yaml states it.
#pragma once

#include <vector>

#include "calibration/calibrate.h"

namespace ear::calibration {

/// `calibration` with the standard deviations of the findings, in the places where the filter looks for them.
[[nodiscard]] Calibration with_sigmas(Calibration calibration, const std::vector<Finding>& findings);

}  // namespace ear::calibration
