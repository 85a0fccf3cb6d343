// Reads a whole recording and reports whether it can be used, and what is odd about it.
#pragma once

#include <filesystem>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "src/recording/calibration_files.h"
#include "src/recording/imu_check.h"
#include "src/recording/recording.h"
#include "src/recording/stream_timing.h"
#include "src/recording/warnings.h"

namespace ear {

/// One sensor's stream.
struct StreamReport {
  std::string name;              ///< "imu0", "encoder0", "laser0", "cam0+cam1"
  double nominal_rate_hz = 0.0;  ///< of its sensor.yaml; 0: not given
  TimingReport timing;
  double covered_by_imu = 0.0;  ///< share of its time during which there are inertial samples: 0 to 1
};

/// What `ear check` reports.
struct RecordingReport {
  std::vector<StreamReport> streams;
  ImuReport imu;
  std::vector<Finding> findings;           ///< errors make the recording unusable
  std::vector<Warning> warnings;           ///< what was left out while reading
  std::optional<Calibration> calibration;  ///< nothing if it cannot be read

  /// No finding is an error.
  [[nodiscard]] bool usable() const;
};

/// Reads everything. What makes the recording unusable is a finding, not an exception.
/// `calibration_files`: see load_calibration().
[[nodiscard]] RecordingReport check_recording(const std::filesystem::path& folder,
                                              const std::vector<std::filesystem::path>& calibration_files);

/// The same of what `open` opens, a bag for example.
[[nodiscard]] RecordingReport check_recording(const std::function<Recording(const RecordingOptions&)>& open,
                                              const std::vector<std::filesystem::path>& calibration_files);

}  // namespace ear
