#include "src/ros2/topics.h"

#include <algorithm>
#include <cctype>
#include <initializer_list>

#include "src/recording/yaml_map.h"

namespace ear::ros2 {
namespace {

constexpr const char* kImu = "sensor_msgs/msg/Imu";
constexpr const char* kImage = "sensor_msgs/msg/Image";
constexpr const char* kCompressedImage = "sensor_msgs/msg/CompressedImage";
constexpr const char* kJointState = "sensor_msgs/msg/JointState";
constexpr const char* kRange = "sensor_msgs/msg/Range";
constexpr const char* kLaserScan = "sensor_msgs/msg/LaserScan";

bool has_any(const std::string& name, std::initializer_list<const char*> words) {
  std::string lower = name;
  std::transform(lower.begin(), lower.end(), lower.begin(), [](unsigned char c) { return std::tolower(c); });
  return std::any_of(words.begin(), words.end(), [&](const char* w) { return lower.find(w) != std::string::npos; });
}

/// Names of one or more types, in alphabetical order.
std::vector<std::string> of_type(const std::vector<Topic>& there, std::initializer_list<const char*> types) {
  std::vector<std::string> names;
  for (const Topic& topic : there) {
    if (std::any_of(types.begin(), types.end(), [&](const char* type) { return topic.type == type; })) {
      names.push_back(topic.name);
    }
  }
  std::sort(names.begin(), names.end());
  return names;
}

std::string first_with(const std::vector<std::string>& names, std::initializer_list<const char*> words) {
  const auto found = std::find_if(names.begin(), names.end(), [&](const auto& name) { return has_any(name, words); });
  return found == names.end() ? std::string() : *found;
}

void guess_imu(SensorTopics& topics, const std::vector<Topic>& there, std::vector<std::string>& notes) {
  if (!topics.imu.empty() || !topics.gyro.empty() || !topics.accel.empty()) return;
  const std::vector<std::string> names = of_type(there, {kImu});
  const std::string gyro = first_with(names, {"gyro"}), accel = first_with(names, {"accel"});
  std::vector<std::string> united;
  for (const std::string& name : names) {
    if (name != gyro && name != accel) united.push_back(name);
  }
  if (united.empty() && !gyro.empty() && !accel.empty()) {
    topics.gyro = gyro;
    topics.accel = accel;
    notes.push_back("gyro: " + gyro + ", accel: " + accel);
    return;
  }
  if (names.empty()) return;
  topics.imu = united.empty() ? names.front() : united.front();
  notes.push_back("imu: " + topics.imu + (names.size() > 1 ? ", the first of " + joined(names) : ""));
}

/// Of raw and compressed topics of one camera the raw one; of two cameras left before right by their names.
void guess_cameras(SensorTopics& topics, const std::vector<Topic>& there, std::vector<std::string>& notes) {
  if (!topics.left.empty() || !topics.right.empty()) return;
  std::vector<std::string> names = of_type(there, {kImage});
  for (const std::string& name : of_type(there, {kCompressedImage})) {
    const std::string raw = name.substr(0, name.rfind('/'));  // image_transport: /cam0/image_raw/compressed
    if (std::find(names.begin(), names.end(), raw) == names.end()) names.push_back(name);
  }
  names.erase(std::remove_if(names.begin(), names.end(),
                             [](const auto& n) {
                               return has_any(n, {"depth", "features"});
                             }),
              names.end());
  std::sort(names.begin(), names.end());
  if (names.empty()) return;
  const std::string left = first_with(names, {"left", "infra1", "cam0", "camera0"});
  const std::string right = first_with(names, {"right", "infra2", "cam1", "camera1"});
  if (!left.empty() && !right.empty() && left != right) {
    topics.left = left;
    topics.right = right;
  } else {
    topics.left = names[0];
    if (names.size() == 2) topics.right = names[1];
  }
  notes.push_back("left: " + topics.left + (topics.right.empty() ? ", no right one" : ", right: " + topics.right) +
                  (names.size() > 2 ? ", of " + joined(names) : ""));
}

void guess_wheels(SensorTopics& topics, const std::vector<Topic>& there, std::vector<std::string>& notes) {
  if (!topics.wheels.empty()) return;
  const std::vector<std::string> names = of_type(there, {kJointState});
  if (names.empty()) return;
  const std::string wheel = first_with(names, {"wheel"});
  topics.wheels = wheel.empty() ? names.front() : wheel;
  notes.push_back("wheels: " + topics.wheels + (names.size() > 1 ? ", of " + joined(names) : ""));
}

void guess_beams(SensorTopics& topics, const std::vector<Topic>& there, std::vector<std::string>& notes) {
  if (topics.beam_count() > 0) return;
  std::vector<std::string> names = of_type(there, {kRange});
  if (names.empty()) names = of_type(there, {kLaserScan});
  for (std::size_t i = 0; i < std::min(names.size(), topics.beams.size()); ++i) {
    topics.beams[i] = names[i];
    notes.push_back("beam_" + std::to_string(i) + ": " + names[i]);
  }
  if (names.size() > topics.beams.size()) notes.push_back("more than three ranges: " + joined(names));
}

}  // namespace

std::string joined(const std::vector<std::string>& names) {
  std::string text;
  for (const std::string& name : names) text += (text.empty() ? "" : ", ") + name;
  return text;
}

std::size_t SensorTopics::beam_count() const {
  return static_cast<std::size_t>(
      std::count_if(beams.begin(), beams.end(), [](const std::string& name) { return !name.empty(); }));
}

SensorTopics load_sensor_topics(const std::filesystem::path& config_file) {
  SensorTopics topics;
  const YamlMap file = YamlMap::load(config_file);
  if (!file.has("topics")) return topics;
  const YamlMap map = file.child("topics");
  std::vector<std::string> known{"calibration"};
  const auto read = [&](const std::string& key, std::string& value) {
    known.push_back(key);
    value = map.get_or(key, value);
  };
  read("imu", topics.imu);
  read("gyro", topics.gyro);
  read("accel", topics.accel);
  read("left", topics.left);
  read("right", topics.right);
  read("left_info", topics.left_info);
  read("right_info", topics.right_info);
  read("wheels", topics.wheels);
  read("left_joint", topics.left_joint);
  read("right_joint", topics.right_joint);
  for (std::size_t i = 0; i < topics.beams.size(); ++i) read("beam_" + std::to_string(i), topics.beams[i]);
  read("tf_static", topics.tf_static);
  read("base_frame", topics.base_frame);
  read("truth", topics.truth);
  map.require_only(known);
  if (topics.gyro.empty() != topics.accel.empty()) throw map.error("gyro", "needs accel, and accel needs gyro");
  if (!topics.imu.empty() && !topics.gyro.empty()) throw map.error("imu", "either imu, or gyro and accel");
  topics.calibration = map.get_or("calibration", std::string());
  if (topics.calibration.is_relative() && !topics.calibration.empty()) {
    topics.calibration = config_file.parent_path() / topics.calibration;
  }
  return topics;
}

SensorTopics guess_topics(SensorTopics stated, const std::vector<Topic>& there, std::vector<std::string>& notes) {
  guess_imu(stated, there, notes);
  guess_cameras(stated, there, notes);
  guess_wheels(stated, there, notes);
  guess_beams(stated, there, notes);
  if (stated.left_info.empty() && !stated.left.empty()) stated.left_info = info_topic_of(stated.left);
  if (stated.right_info.empty() && !stated.right.empty()) stated.right_info = info_topic_of(stated.right);
  return stated;
}

std::string info_topic_of(const std::string& image_topic) {
  std::string topic = image_topic;
  const std::string transport = "/compressed";
  if (topic.size() > transport.size() &&
      topic.compare(topic.size() - transport.size(), transport.size(), transport) == 0) {
    topic.erase(topic.size() - transport.size());
  }
  const std::size_t slash = topic.rfind('/');
  return (slash == std::string::npos ? std::string() : topic.substr(0, slash)) + "/camera_info";
}

SensorTopics default_topics() {
  SensorTopics topics;
  topics.imu = "/imu0";
  topics.left = "/cam0/image_raw";
  topics.right = "/cam1/image_raw";
  topics.left_info = info_topic_of(topics.left);
  topics.right_info = info_topic_of(topics.right);
  topics.wheels = "/wheels";
  topics.left_joint = "left";
  topics.right_joint = "right";
  topics.beams = {"/laser/0", "/laser/1", "/laser/2"};
  return topics;
}

}  // namespace ear::ros2
