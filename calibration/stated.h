// A calibration with what is known of its values, as sensor.yaml states it.
#pragma once

#include <Eigen/Core>
#include <optional>
#include <string>
#include <vector>

#include "calibration/calibrate.h"

namespace ear::calibration {

/// `calibration` with the standard deviations of the findings, in the places where the filter looks for them. It takes
/// them for independent. What is turned against the accelerometer together, cameras, gyroscope and axle, is not: these
/// are stated so much larger that the filter takes nothing for better known than `covariance`, of the findings, says.
[[nodiscard]] Calibration with_sigmas(Calibration calibration, const std::vector<Finding>& findings,
                                      const Eigen::MatrixXd& covariance);

/// Root mean square of the standard deviations of all entries whose name begins so, in their unit. Nothing where there
/// is none.
[[nodiscard]] std::optional<double> mean_sigma(const std::vector<Finding>& findings, const std::string& name);

}  // namespace ear::calibration
