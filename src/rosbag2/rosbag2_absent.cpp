// In the place of all others here where the libraries for ROS 2 bags are not installed.
#include "src/recording/input_error.h"
#include "src/rosbag2/rosbag2.h"

namespace ear {
namespace {

namespace fs = std::filesystem;

InputError absent(const fs::path& file) {
  return InputError(located(file, 0, "", "this program was built without ROS 2 bags: see docs/ros2.md"));
}

}  // namespace

bool ros2_bags_are_built() { return false; }

bool is_ros2_bag(const fs::path& path) {
  if (fs::is_directory(path)) return fs::exists(path / "metadata.yaml");
  const std::string name = path.filename().string();
  return name.find(".mcap") != std::string::npos || name.find(".db3") != std::string::npos;
}

std::unique_ptr<SampleSource> open_ros2_bag(const fs::path& bag, const fs::path& /*config*/,
                                            const RecordingOptions& /*options*/, std::vector<std::string>& /*notes*/) {
  throw absent(bag);
}

std::size_t write_mcap(Recording& /*recording*/, const fs::path& file, const fs::path& /*calibration_folder*/,
                       const std::vector<TruePose>& /*truth*/, const std::function<void(std::size_t)>& /*progress*/) {
  throw absent(file);
}

}  // namespace ear
