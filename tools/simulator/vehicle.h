// The simulated vehicle's sensors: where they truly are. What the estimator is given: calibration_error.h.
#pragma once

#include "ear/calibration.h"

namespace ear::simulator {

/// The true geometry and noise figures: D435i-class stereo camera and IMU, two 18-bit encoders, three lasers.
[[nodiscard]] Calibration make_vehicle(double camera_rate_hz, LensModel lens);

}  // namespace ear::simulator
