// A recording as a drive for the batch estimate: read once, with the front end.
#pragma once

#include <filesystem>
#include <functional>
#include <string>
#include <vector>

#include "calibration/drive.h"
#include "ear/config.h"
#include "src/recording/recording.h"

namespace ear::calibration {

/// `calibration`, stating of the right camera's rotation what it and both principal points may be off by before they
/// are calibrated: so far from its epipolar line the front end seeks a feature.
[[nodiscard]] Calibration for_search(Calibration calibration);

/// `progress` is told how far it is, 0 to 1. Throws InputError for a recording that cannot be read, and for one whose
/// images of left and right are exchanged.
[[nodiscard]] Drive recorded_drive(Recording& recording, const std::string& name, const Config& config,
                                   const std::function<void(double)>& progress);

/// In words, for each kind of sample that ends more than two seconds before another: as of a file that was torn.
[[nodiscard]] std::vector<std::string> ends_early(const Drive& drive);

/// Positions of a file that `ear evaluate` reads as a truth (TUM, EuRoC's csv). Those outside of the drive are left
/// out. Throws std::runtime_error, naming the file, where none is left.
void add_reference(const std::filesystem::path& file, double sigma, Drive& drive);

}  // namespace ear::calibration
