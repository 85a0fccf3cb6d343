// What configuration and calibration make of a filter before the first sample: whether they can be used at all, and the
// calibrated part of the state.
#pragma once

#include "ear/calibration.h"
#include "ear/filter_config.h"
#include "filter/ekf/state.h"

namespace ear {

/// [m, rad, 1] of position and yaw at the start, and of the wheels' scale where nothing can measure it: by definition
/// zero, but regular.
inline constexpr double kKnownSigma = 1e-6;
/// [m/s^2] chosen: what rotors, idling or shaking, leave in the mean specific force (docs/decisions/0025).
inline constexpr double kShakenAccel = 0.02;

/// The same, if they are usable. Throw std::invalid_argument, naming the field.
[[nodiscard]] const FilterConfig& checked(const FilterConfig& config);
[[nodiscard]] const Calibration& checked(const Calibration& calibration);

/// The settings for these sensors: the standard deviations that the calibration states replace those of
/// FilterConfig::prior, and an IMU whose usual interval is long has no gap at each. Both are usable.
[[nodiscard]] FilterConfig settings_for(const FilterConfig& config, const Calibration& calibration);

/// Are there laser beams?
[[nodiscard]] bool has_beams(const Calibration& calibration);
/// Are there wheels that are used?
[[nodiscard]] bool uses_wheels(const FilterConfig& config, const Calibration& calibration);
/// Pixels per unit of normalized coordinates; 1 without a camera, where nothing is measured in pixels.
[[nodiscard]] double focal_length(const Calibration& calibration);

/// Standard deviations of a lens before the first image, as stated or by the prior: focal length (relative), principal
/// point over the focal length along u and v.
[[nodiscard]] Eigen::Vector3d lens_sigma(const PriorConfig& prior, const CameraCalibration& camera);

/// Standard deviation of the odometer's rotation in the body [rad], as stated or by the prior.
[[nodiscard]] double odometer_rotation_sigma(const PriorConfig& prior, const Calibration& calibration);

[[nodiscard]] CameraState camera_state(const Calibration& calibration);
[[nodiscard]] OdometerState odometer_state(const Calibration& calibration);

}  // namespace ear
