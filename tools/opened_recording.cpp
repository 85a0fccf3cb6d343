#include "tools/opened_recording.h"

#include <stdlib.h>

#include <string>
#include <system_error>

#include "src/bag/bag.h"
#include "src/log/log.h"
#include "src/recording/input_error.h"

namespace ear::tools {
namespace {

namespace fs = std::filesystem;

fs::path make_temporary_folder() {
  std::string name = (fs::temp_directory_path() / "ear-bag-XXXXXX").string();
  if (!mkdtemp(name.data())) throw InputError(located(name, 0, "", "cannot be created"));
  return name;
}

}  // namespace

OpenedRecording::OpenedRecording(const fs::path& recording, const fs::path& config) : recording_(recording) {
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

OpenedRecording::~OpenedRecording() {
  std::error_code ignored;  // a temporary folder that stays is no reason to fail
  if (!temporary_.empty()) fs::remove_all(temporary_, ignored);
}

}  // namespace ear::tools
