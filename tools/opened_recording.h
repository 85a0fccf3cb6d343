// What stands on the command line as RECORDING: a folder, or a bag of ROS 1 or 2.
#pragma once

#include <filesystem>

#include "src/recording/recording.h"

namespace ear::tools {

/// A bag of ROS 1 (a file that ends in .bag) is unpacked to a temporary folder, which the end of this object deletes;
/// one of ROS 2 is read as it is; anything else is taken for a recording's folder.
class OpenedRecording {
 public:
  /// `config`: settings that may name the bag's topics; may be empty. Throws InputError.
  OpenedRecording(const std::filesystem::path& recording, const std::filesystem::path& config);
  ~OpenedRecording();
  OpenedRecording(const OpenedRecording&) = delete;
  OpenedRecording& operator=(const OpenedRecording&) = delete;
  OpenedRecording(OpenedRecording&&) = delete;
  OpenedRecording& operator=(OpenedRecording&&) = delete;

  /// Its samples. What is guessed of a bag's topics goes to standard error. Throws InputError.
  [[nodiscard]] Recording read(const RecordingOptions& options) const;

  /// It as a folder; a bag of ROS 2 is unpacked for this, too. Throws InputError.
  [[nodiscard]] const std::filesystem::path& folder();

 private:
  std::filesystem::path recording_;
  std::filesystem::path config_;
  std::filesystem::path temporary_;
  bool is_ros2_ = false;
};

}  // namespace ear::tools
