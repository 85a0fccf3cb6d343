#include "src/rosbag2/rosbag2.h"

#include <limits>

#include "src/rosbag2/bag.h"
#include "src/rosbag2/bag_source.h"
#include "src/rosbag2/recording_writer.h"

namespace ear {

namespace fs = std::filesystem;

bool ros2_bags_are_built() { return true; }

bool is_ros2_bag(const fs::path& path) { return rosbag2::is_bag(path); }

std::unique_ptr<SampleSource> open_ros2_bag(const fs::path& bag, const fs::path& config,
                                            const RecordingOptions& options, std::vector<std::string>& notes) {
  const ros2::SensorTopics stated = config.empty() ? ros2::SensorTopics{} : ros2::load_sensor_topics(config);
  return rosbag2::open_bag(bag, stated, options, notes);
}

std::size_t write_mcap(Recording& recording, const fs::path& file, const fs::path& calibration_folder,
                       const std::vector<TruePose>& truth, const std::function<void(std::size_t)>& progress) {
  rosbag2::RecordingWriter writer(file, ros2::default_topics(), recording.calibration(), calibration_folder);
  auto pose = truth.begin();
  const auto write_truth_until = [&](TimeNs t_ns) {
    for (; pose != truth.end() && pose->t_ns <= t_ns; ++pose) writer.write_truth(pose->t_ns, pose->q_WB, pose->p_WB);
  };
  std::size_t samples = 0;
  while (const auto sample = recording.next()) {
    writer.write(*sample);
    write_truth_until(time_of(*sample));
    progress(++samples);
  }
  write_truth_until(std::numeric_limits<TimeNs>::max());
  writer.close();
  return samples;
}

}  // namespace ear
