// Where a live process has its calibration from, and whether it suffices.
#pragma once

#include <filesystem>

#include "ear/calibration.h"
#include "src/live/live_settings.h"

namespace ear::live {

/// The calibration that the settings name, or else `played`, that of a recording in place of the sensors; without
/// either what Kalibr's files say, and the rest as topics of ROS 2 will. Throws InputError.
[[nodiscard]] Calibration known_calibration(const LiveSettings& settings, const Calibration* played);

/// Throws InputError where no estimate can come of it; logs what is odd.
void require_usable(const Calibration& calibration, const LiveSettings& settings);

/// A calibration as files, for as long as it lives; a recording that carries them gives the same to the last bit.
class SensorFiles {
 public:
  /// Writes the sensors' files to a temporary folder, unless `folder` is where `calibration` was read from. Throws
  /// InputError.
  SensorFiles(const Calibration& calibration, std::filesystem::path folder);
  ~SensorFiles();
  SensorFiles(const SensorFiles&) = delete;
  SensorFiles& operator=(const SensorFiles&) = delete;
  SensorFiles(SensorFiles&&) = delete;
  SensorFiles& operator=(SensorFiles&&) = delete;

  [[nodiscard]] const std::filesystem::path& folder() const { return folder_; }
  /// As it is read from there.
  [[nodiscard]] Calibration read() const;

 private:
  std::filesystem::path folder_;
  bool temporary_ = false;
};

}  // namespace ear::live
