// What a calibration found, for people and for programs.
#pragma once

#include <string>

#include "calibration/allan.h"
#include "calibration/calibrate.h"

namespace ear::calibration {

/// A table: value, change, prior, posterior, what it is entangled with; then what was not shown, and what would show
/// it.
[[nodiscard]] std::string to_text(const Result& result);
[[nodiscard]] std::string to_json(const Result& result);

/// White noise and random walk of each axis with their uncertainty, and the lines for imu0/sensor.yaml.
[[nodiscard]] std::string to_text(const ImuNoise& noise);
[[nodiscard]] std::string to_json(const ImuNoise& noise);

}  // namespace ear::calibration
