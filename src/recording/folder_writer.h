// Recordings and calibrations to folders in the layout of docs/recordings.md.
#pragma once

#include <filesystem>

#include "ear/calibration.h"
#include "src/recording/recording.h"

namespace ear {

/// Writes <sensor>/sensor.yaml below `folder` for every sensor of the calibration, for load_calibration(). Numbers come
/// back as they are, but for rotations and directions, which it makes orthonormal once more (1e-15). Throws InputError
/// if a file cannot be written.
void write_sensor_files(const Calibration& calibration, const std::filesystem::path& folder);

/// Reads a recording to its end and writes all of it, with its calibration, to `folder`/mav0. Images become .pgm files,
/// frames that came late get an arrival.csv. Throws InputError.
void write_folder(Recording& recording, const std::filesystem::path& folder);

}  // namespace ear
