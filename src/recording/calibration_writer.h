// A calibration into sensor.yaml files, as load_calibration() reads them.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "ear/calibration.h"

namespace ear {

/// What stands beside a beam for people: the filter reads LaserCalibration::offset_sigma alone.
struct BeamSigma {
  double origin = 0.0;     ///< [m]
  double direction = 0.0;  ///< [rad]
};

/// Writes `folder`/cam0/sensor.yaml and so on, one for each sensor, with the standard deviations that the calibration
/// states. `heading` is a comment at the top of each; `beams` may be empty. Throws InputError, naming the file, where
/// it cannot be written.
void write_calibration(const Calibration& calibration, const std::filesystem::path& folder, const std::string& heading,
                       const std::vector<BeamSigma>& beams);

/// The file of one camera alone.
void write_camera(const Calibration& calibration, std::size_t index, const std::filesystem::path& folder,
                  const std::string& heading);

}  // namespace ear
