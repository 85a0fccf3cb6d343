// What stands on the command line as RECORDING: a folder, or a ROS 1 bag.
#pragma once

#include <filesystem>

namespace ear::tools {

/// A bag (a file that ends in .bag) is unpacked to a temporary folder, which the end of this object deletes; anything
/// else is taken for a recording's folder.
class OpenedRecording {
 public:
  /// `config`: settings that may name the bag's topics; may be empty. Throws InputError.
  OpenedRecording(const std::filesystem::path& recording, const std::filesystem::path& config);
  ~OpenedRecording();
  OpenedRecording(const OpenedRecording&) = delete;
  OpenedRecording& operator=(const OpenedRecording&) = delete;
  OpenedRecording(OpenedRecording&&) = delete;
  OpenedRecording& operator=(OpenedRecording&&) = delete;

  [[nodiscard]] const std::filesystem::path& folder() const { return temporary_.empty() ? recording_ : temporary_; }

 private:
  std::filesystem::path recording_;
  std::filesystem::path temporary_;
};

}  // namespace ear::tools
