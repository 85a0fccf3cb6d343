// A recording as Python holds it.
#pragma once

#include <memory>

#include "python/binding/guarded.h"
#include "src/recording/recording.h"
#include "tools/opened_recording.h"

namespace ear::python {

/// The recording, and what keeps its files; one thread reads at a time.
struct OpenRecording {
  OpenRecording(const std::filesystem::path& given, const std::filesystem::path& config,
                const RecordingOptions& options)
      : opened(given, config), path(given), recording(opened.read(options)) {}

  tools::OpenedRecording opened;
  std::filesystem::path path;
  Recording recording;
};

using GuardedRecording = Guarded<OpenRecording>;

}  // namespace ear::python
