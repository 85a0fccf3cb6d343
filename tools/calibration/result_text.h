// What a calibration found, for people and for programs.
#pragma once

#include <optional>
#include <string>

#include "calibration/allan.h"
#include "calibration/board.h"
#include "calibration/calibrate.h"

namespace ear::calibration {

/// A table: value, change, prior, posterior, what it is entangled with; then what was not shown, and what would show
/// it.
[[nodiscard]] std::string to_text(const Result& result);
[[nodiscard]] std::string to_json(const Result& result);

/// Lenses and stereo pose, what the views were like, and what the board's motion did not show.
[[nodiscard]] std::string to_text(const BoardResult& result);
[[nodiscard]] std::string to_json(const BoardResult& result);

/// White noise and random walk of each axis with their uncertainty, and the lines for imu0/sensor.yaml.
[[nodiscard]] std::string to_text(const ImuNoise& noise);
[[nodiscard]] std::string to_json(const ImuNoise& noise, const std::optional<MotionNoise>& motion = {});
/// How much each axis jitters more in motion, and the factor for the noise of each sensor.
[[nodiscard]] std::string to_text(const MotionNoise& motion);

}  // namespace ear::calibration
