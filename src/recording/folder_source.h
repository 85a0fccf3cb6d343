// The layout of docs/recordings.md as a source of samples.
#pragma once

#include <filesystem>
#include <memory>

#include "src/recording/sample_source.h"

namespace ear {

/// `folder` is RECORDING or RECORDING/mav0. Throws InputError if there is no IMU.
[[nodiscard]] std::unique_ptr<SampleSource> open_folder(const std::filesystem::path& folder,
                                                        const RecordingOptions& options);

}  // namespace ear
