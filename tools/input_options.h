// Options of the subcommands that estimate from a recording.
#pragma once

#include <filesystem>
#include <vector>

#include <CLI/CLI.hpp>

namespace ear::tools {

/// --config FILE
inline void add_config_option(CLI::App& command, std::filesystem::path& config) {
  command.add_option("--config", config, "Settings; what it leaves out keeps its default")->check(CLI::ExistingFile);
}

/// --calibration FILE|FOLDER..., see load_calibration()
inline void add_calibration_option(CLI::App& command, std::vector<std::filesystem::path>& calibration) {
  command
      .add_option("--calibration", calibration,
                  "Kalibr's camchain-imucam.yaml and imu.yaml, or a folder of ear calibrate, instead of sensor.yaml")
      ->check(CLI::ExistingPath);
}

}  // namespace ear::tools
