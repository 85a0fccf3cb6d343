#include "src/rosbag2/bag_calibration.h"

#include <algorithm>
#include <cstdlib>
#include <fstream>
#include <optional>
#include <system_error>

#include "src/recording/calibration_files.h"
#include "src/recording/input_error.h"
#include "src/ros2/calibration_messages.h"

namespace ear::rosbag2 {
namespace {

namespace fs = std::filesystem;

constexpr std::size_t kRateMessages = 200;
constexpr std::size_t kMostTransforms = 1000;  // messages of tf_static

const std::string kAttachments = "calibration/";

/// The folder with <sensor>/sensor.yaml, made of attachments if need be; deleted with this object.
class CalibrationFolder {
 public:
  CalibrationFolder(const Bag& bag, const ros2::SensorTopics& topics) : folder_(topics.calibration) {
    if (!folder_.empty() && !fs::is_directory(folder_)) throw InputError(located(folder_, 0, "", "no such folder"));
    if (folder_.empty()) folder_ = calibration_beside(bag.path());
    if (!fs::is_directory(folder_)) unpack(bag.attachments());
  }
  ~CalibrationFolder() {
    std::error_code ignored;
    if (!temporary_.empty()) fs::remove_all(temporary_, ignored);
  }
  CalibrationFolder(const CalibrationFolder&) = delete;
  CalibrationFolder& operator=(const CalibrationFolder&) = delete;
  CalibrationFolder(CalibrationFolder&&) = delete;
  CalibrationFolder& operator=(CalibrationFolder&&) = delete;

  [[nodiscard]] const fs::path& path() const { return folder_; }
  [[nodiscard]] bool has(const char* sensor) const { return fs::is_directory(folder_ / sensor); }

 private:
  void unpack(const std::map<std::string, std::string>& attachments) {
    for (const char* sensor : {"imu0", "cam0", "cam1", "encoder0", "laser0"}) {
      const auto file = attachments.find(kAttachments + sensor + "/sensor.yaml");
      if (file == attachments.end()) continue;
      if (temporary_.empty()) {
        std::string name = (fs::temp_directory_path() / "ear-calibration-XXXXXX").string();
        if (mkdtemp(name.data()) == nullptr) throw InputError(located(name, 0, "", "cannot be created"));
        folder_ = temporary_ = name;
      }
      fs::create_directories(folder_ / sensor);
      std::ofstream(folder_ / sensor / "sensor.yaml", std::ios::binary) << file->second;
    }
  }

  fs::path folder_;
  fs::path temporary_;
};

/// The first message of each topic that says something about the calibration, and all of tf_static.
ros2::CalibrationMessages read_messages(const Bag& bag, const ros2::SensorTopics& topics, Warnings& warnings) {
  ros2::CalibrationMessages messages(topics);
  std::vector<std::string> first{topics.left_info, topics.right_info, topics.imu_apart() ? topics.gyro : topics.imu};
  first.insert(first.end(), topics.beams.begin(), topics.beams.end());
  for (const std::string& topic : first) {
    BagPass pass = bag.pass({topic});
    if (const auto message = pass.next(warnings)) messages.take(*message);
  }
  BagPass tf = bag.pass({topics.tf_static});
  for (std::size_t i = 0; i < kMostTransforms; ++i) {
    const auto message = tf.next(warnings);
    if (!message) break;
    messages.take(*message);
  }
  return messages;
}

/// The rate of a topic's first messages by their stamps [Hz]; nothing if they are too few.
std::optional<double> rate_of(const Bag& bag, const std::string& topic, Warnings& warnings) {
  BagPass pass = bag.pass({topic});
  std::vector<TimeNs> stamps;
  for (std::size_t i = 0; i < kRateMessages; ++i) {
    const auto message = pass.next(warnings);
    if (!message) break;
    try {
      stamps.push_back(ros2::stamp_of(*message, ros2::decode<ros2::Imu>(*message).header));
    } catch (const InputError&) {  // the reading itself reports it
    }
  }
  std::vector<TimeNs> intervals;
  for (std::size_t i = 1; i < stamps.size(); ++i) intervals.push_back(duration_ns(stamps[i - 1], stamps[i]));
  if (intervals.empty()) return std::nullopt;
  const auto median = intervals.begin() + static_cast<std::ptrdiff_t>(intervals.size() / 2);
  std::nth_element(intervals.begin(), median, intervals.end());
  return *median > 0 ? std::optional<double>(1e9 / static_cast<double>(*median)) : std::nullopt;
}

std::size_t camera_count(const ros2::SensorTopics& topics) {
  if (topics.left.empty()) return 0;
  return topics.right.empty() ? 1 : 2;
}

}  // namespace

fs::path calibration_beside(const fs::path& bag) {
  fs::path folder = bag.has_filename() ? bag : bag.parent_path();
  if (!fs::is_directory(folder)) folder.replace_extension();
  if (folder.extension() == ".mcap" || folder.extension() == ".db3") folder.replace_extension();  // was .mcap.zstd
  return folder += ".calibration";
}

Calibration bag_calibration(const Bag& bag, const ros2::SensorTopics& topics, const RecordingOptions& options,
                            Warnings& warnings) {
  const CalibrationFolder folder(bag, topics);
  Calibration calibration =
      load_calibration(folder.path(), options.calibration_files, warnings, CalibrationKind::alone);
  if (!folder.has("imu0") && options.calibration_files.empty()) {
    const std::string& topic = topics.imu_apart() ? topics.gyro : topics.imu;
    calibration.imu.rate_hz = rate_of(bag, topic, warnings).value_or(calibration.imu.rate_hz);
  }
  const std::size_t cameras = camera_count(topics);
  calibration.cameras.resize(std::min(calibration.cameras.size(), cameras));
  if (topics.wheels.empty()) calibration.encoder.reset();
  if (topics.beam_count() == 0) calibration.lasers.reset();

  const bool needs_messages = calibration.cameras.size() < cameras || (topics.beam_count() > 0 && !calibration.lasers);
  if (needs_messages) {
    const ros2::CalibrationMessages messages = read_messages(bag, topics, warnings);
    try {
      if (calibration.cameras.size() < cameras) calibration.cameras = messages.cameras();
    } catch (const InputError& error) {
      throw InputError(located(bag.path(), 0, "",
                               std::string(error.what()) + "; a folder of sensor.yaml files (topics: calibration), or "
                                                           "Kalibr's files (--calibration) can say it"));
    }
    const std::string missing = messages.missing_for_beams();
    if (topics.beam_count() > 0 && !calibration.lasers && missing.empty()) calibration.lasers = messages.lasers();
    if (topics.beam_count() > 0 && !calibration.lasers) {
      warnings.add("lasers are left out: no calibration", located(bag.path(), 0, topics.beams[0], missing));
    }
  }
  if (!topics.wheels.empty() && !calibration.encoder) {
    warnings.add("wheels are left out: no calibration",
                 located(bag.path(), 0, topics.wheels, "no encoder0/sensor.yaml in " + folder.path().string()));
  }
  return calibration;
}

}  // namespace ear::rosbag2
