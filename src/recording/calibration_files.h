// Calibration from files: the sensor.yaml of a recording's sensors, or Kalibr's results as they are.
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "ear/calibration.h"
#include "src/recording/warnings.h"

namespace ear {

/// What a folder with <sensor>/sensor.yaml is.
enum class CalibrationKind {
  recording,  ///< it has the sensors' data too: cameras without a folder are left out, imu0/sensor.yaml must be there
  alone       ///< all cameras of Kalibr count; without imu0/sensor.yaml the noise of ear/calibration.h, with a warning
};

/// The calibration of the sensors that a recording has (folders with a data.csv), from their sensor.yaml files.
///
/// Of `calibration_files`, Kalibr's (camchain-imucam.yaml and/or imu.yaml, in any order) replace the cameras and the
/// IMU, and folders with sensor.yaml files (of `ear calibrate`, or another recording) those of the sensors they hold.
/// If imu0's T_BS is not the identity, all other poses are turned into the IMU's frame, which is our body, and a
/// warning says so. Throws InputError.
[[nodiscard]] Calibration load_calibration(const std::filesystem::path& mav0,
                                           const std::vector<std::filesystem::path>& calibration_files,
                                           Warnings& warnings, CalibrationKind kind = CalibrationKind::recording);

/// Kalibr's results: camchain-imucam.yaml (T_cam_imu or T_cn_cnm1, intrinsics, timeshift_cam_imu) and its imu.yaml,
/// bare or below a key imu0. Throws InputError.
[[nodiscard]] Calibration load_kalibr(const std::filesystem::path& camchain, const std::filesystem::path& imu);

/// How bad a finding is.
enum class Severity {
  warning,  ///< unusual; the estimate may suffer
  error     ///< cannot be; no estimate is worth anything
};

/// Something about a calibration that cannot be right, or hardly.
struct Finding {
  Severity severity = Severity::warning;
  std::string where;    ///< sensor and key: "cam0: T_BS"
  std::string message;  ///< what is wrong, with the value
};

/// Looks for what cannot be: rotations that are none, swapped cameras, absurd focal lengths, noise that is not
/// positive.
[[nodiscard]] std::vector<Finding> check_calibration(const Calibration& calibration);

/// Are there enough sensors for an estimate? An error where there is neither a camera nor wheels: the velocity that
/// inertia alone gives is soon anything. For `ear run` and `ear check` alike.
[[nodiscard]] std::optional<Finding> check_sensors(const Calibration& calibration);

}  // namespace ear
