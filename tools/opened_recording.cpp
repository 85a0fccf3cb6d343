#include "tools/opened_recording.h"

#include <cstdio>
#include <cstdlib>
#include <string>
#include <system_error>
#include <utility>
#include <vector>

#include "src/bag/bag.h"
#include "src/log/log.h"
#include "src/recording/folder_writer.h"
#include "src/recording/input_error.h"
#include "src/rosbag2/rosbag2.h"

namespace ear::tools {
namespace {

namespace fs = std::filesystem;

fs::path make_temporary_folder() {
  std::string name = (fs::temp_directory_path() / "ear-bag-XXXXXX").string();
  if (!mkdtemp(name.data())) throw InputError(located(name, 0, "", "cannot be created"));
  return name;
}

}  // namespace

OpenedRecording::OpenedRecording(const fs::path& recording, const fs::path& config)
    : recording_(recording), config_(config), is_ros2_(is_ros2_bag(recording)) {
  if (recording.extension() != ".bag" || fs::is_directory(recording)) return;
  const BagTopics topics = config.empty() ? BagTopics{} : load_topics(config);
  temporary_ = make_temporary_folder();
  try {
    log_info(recording.string() + ": being unpacked to " + temporary_.string());
    unpack_bag(recording, topics, temporary_);
  } catch (...) {
    fs::remove_all(temporary_);
    throw;
  }
}

Recording OpenedRecording::read(const RecordingOptions& options) const {
  if (!is_ros2_) return Recording(temporary_.empty() ? recording_ : temporary_, options);
  std::vector<std::string> notes;
  Recording recording(open_ros2_bag(recording_, config_, options, notes), options);
  for (const std::string& note : notes) std::fprintf(stderr, "%s: guessed: %s\n", recording_.c_str(), note.c_str());
  return recording;
}

const fs::path& OpenedRecording::folder() {
  if (temporary_.empty() && is_ros2_) {
    temporary_ = make_temporary_folder();
    RecordingOptions options;
    options.accept_bad_calibration = true;  // the samples are what is asked for
    Recording recording = read(options);
    write_folder(recording, temporary_);
  }
  return temporary_.empty() ? recording_ : temporary_;
}

OpenedRecording::~OpenedRecording() {
  std::error_code ignored;  // a temporary folder that stays is no reason to fail
  if (!temporary_.empty()) fs::remove_all(temporary_, ignored);
}

}  // namespace ear::tools
