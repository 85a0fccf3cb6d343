// What a calibration leaves in its folder.
#pragma once

#include <filesystem>
#include <string>

#include "calibration/calibrate.h"

namespace ear::calibration {

/// sensor.yaml files, calibration.txt and calibration.json. Returns the text of calibration.txt. Throws InputError,
/// naming the file, where one cannot be written.
std::string write_result(const Result& result, const std::filesystem::path& folder);

/// One text file. Throws InputError.
void write_text(const std::filesystem::path& file, const std::string& text);

}  // namespace ear::calibration
