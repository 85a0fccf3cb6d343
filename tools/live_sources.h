// What `ear live` reads: opens the sources that its settings name.
#pragma once

#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "src/live/live_settings.h"
#include "src/live/mavlink_output.h"
#include "src/live/player.h"
#include "src/live/stereo_camera.h"

namespace ear::tools {

/// The calibration that the settings name, or else that of the recording that is played; without either what Kalibr's
/// files say, and the rest as topics of ROS 2 will. Throws InputError.
[[nodiscard]] Calibration live_calibration(const live::LiveSettings& settings, const live::Player* player);

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

/// Throws InputError where no estimate can come of it; logs what is odd.
void require_usable(const Calibration& calibration, const live::LiveSettings& settings);

/// Opens the video devices; null where the settings name none. Throws std::runtime_error.
[[nodiscard]] std::unique_ptr<live::StereoCamera> open_cameras(const live::LiveSettings& settings,
                                                               live::Intake& intake);

/// The lines to flight controllers and microcontrollers. A line's thread runs as long as this lives.
class MavlinkLines {
 public:
  MavlinkLines(const std::vector<live::MavlinkSettings>& settings, live::Intake& intake);

  /// By the estimator's thread.
  void take(const live::LiveSample& sample);
  void take(const live::LiveFrame& frame);
  [[nodiscard]] std::vector<std::string> look();

 private:
  struct Line {
    std::unique_ptr<live::MavlinkSensors> sensors;
    std::unique_ptr<live::MavlinkOutput> output;
    std::unique_ptr<mavlink::Link> link;
  };

  std::vector<Line> lines_;
};

}  // namespace ear::tools
