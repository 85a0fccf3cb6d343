#include "src/live/live_settings.h"

#include <algorithm>
#include <map>

#include "src/recording/config_file.h"
#include "src/recording/yaml_map.h"

namespace ear::live {
namespace {

namespace fs = std::filesystem;

constexpr int kMostDomain = 232;
constexpr double kBudgetShare = 0.7;  // of the time between two frames

/// Relative to the folder of the configuration file.
fs::path path_of(const fs::path& file, const std::string& text) {
  const fs::path path(text);
  return path.is_absolute() ? path : file.parent_path() / path;
}

MavlinkInputs::Imu imu_choice(const YamlMap& map) {
  const auto name = map.get_or<std::string>("imu", "none");
  if (name == "none") return MavlinkInputs::Imu::none;
  if (name == "HIGHRES_IMU") return MavlinkInputs::Imu::highres;
  if (name == "SCALED_IMU") return MavlinkInputs::Imu::scaled;
  throw map.error("imu", "'" + name + "' is none of HIGHRES_IMU, SCALED_IMU, none");
}

std::vector<int> range_ids(const YamlMap& map) {
  std::vector<int> ids;
  if (!map.has("ranges")) return ids;
  for (const double number : map.numbers("ranges", 0)) {
    const int id = static_cast<int>(number);
    if (number != id || id < 0 || id > 255 || std::count(ids.begin(), ids.end(), id) > 0) {
      throw map.error("ranges", "different ids from 0 to 255 expected, one for each beam");
    }
    ids.push_back(id);
  }
  if (ids.size() > QueuedOdometry::kMaxBeams) throw map.error("ranges", "at most three beams");
  return ids;
}

MavlinkSettings load_mavlink(const YamlMap& map) {
  map.require_only({"address", "system", "send", "mounting_deg", "imu", "wheels", "ranges"});
  MavlinkSettings settings;
  settings.address = map.get<std::string>("address");
  settings.system = map.get_or("system", settings.system);
  if (settings.system < 1 || settings.system > 255) throw map.error("system", "1 to 255 expected");
  settings.send = map.get_or("send", settings.send);
  if (map.has("mounting_deg")) {
    const std::vector<double> degrees = map.numbers("mounting_deg", 3);
    settings.mounting_deg = {degrees[0], degrees[1], degrees[2]};
  }
  settings.inputs.imu = imu_choice(map);
  settings.inputs.wheels = map.get_or("wheels", false);
  settings.inputs.range_ids = range_ids(map);
  return settings;
}

CameraSettings load_cameras(const YamlMap& map, const fs::path& file) {
  map.require_only({"device", "right", "rate", "delay"});
  CameraSettings settings;
  settings.device = path_of(file, map.get<std::string>("device"));
  if (map.has("right")) settings.right = path_of(file, map.get<std::string>("right"));
  settings.rate_hz = map.get_or("rate", settings.rate_hz);
  if (!(settings.rate_hz > 0.0 && settings.rate_hz <= 1000.0)) throw map.error("rate", "0 to 1000 Hz expected");
  settings.delay = map.get_or("delay", settings.delay);
  if (!(settings.delay >= 0.0 && settings.delay < 1.0)) throw map.error("delay", "0 to 1 s expected");
  return settings;
}

RosSettings load_ros(const YamlMap& map) {
  map.require_only({"domain", "publish", "odometry", "predicted", "path", "features", "diagnostics", "odom_frame",
                    "base_frame", "tf", "tf_static"});
  RosSettings settings;
  if (map.has("domain")) {
    settings.domain = map.get<int>("domain");
    if (*settings.domain < 0 || *settings.domain > kMostDomain) throw map.error("domain", "0 to 232 expected");
  }
  settings.publish = map.get_or("publish", settings.publish);
  RosNames& names = settings.names;
  names.odometry = map.get_or("odometry", names.odometry);
  names.predicted = map.get_or("predicted", names.predicted);
  names.path = map.get_or("path", names.path);
  names.features = map.get_or("features", names.features);
  names.diagnostics = map.get_or("diagnostics", names.diagnostics);
  names.odom_frame = map.get_or("odom_frame", names.odom_frame);
  names.base_frame = map.get_or("base_frame", names.base_frame);
  names.tf = map.get_or("tf", names.tf);
  names.tf_static = map.get_or("tf_static", names.tf_static);
  if (names.odometry.empty() || names.diagnostics.empty()) throw map.error("odometry", "a topic's name expected");
  return settings;
}

LogOptions load_log(const YamlMap& map, const fs::path& file) {
  map.require_only({"level", "file", "megabytes", "older_files"});
  static const std::map<std::string, LogLevel> kLevels{
      {"debug", LogLevel::debug}, {"info", LogLevel::info}, {"warning", LogLevel::warning}, {"error", LogLevel::error}};
  LogOptions log;
  const auto level = kLevels.find(map.get_or<std::string>("level", "info"));
  if (level == kLevels.end()) throw map.error("level", "debug, info, warning or error expected");
  log.level = level->second;
  if (map.has("file")) log.file = path_of(file, map.get<std::string>("file"));
  const double megabytes = map.get_or("megabytes", 10.0);
  if (!(megabytes > 0.0 && megabytes < 1e6)) throw map.error("megabytes", "must be positive");
  log.most_bytes = static_cast<std::size_t>(1e6 * megabytes);
  const int older = map.get_or("older_files", 3);
  if (older < 0 || older > 100) throw map.error("older_files", "0 to 100 expected");
  log.older_files = static_cast<std::size_t>(older);
  return log;
}

}  // namespace

LiveSettings load_live_settings(const fs::path& file) {
  const YamlMap map = YamlMap::load(file);
  map.require_only(
      {"calibration", "kalibr", "settings", "budget_ms", "frame_slots", "mavlink", "cameras", "ros", "topics", "log"});
  LiveSettings settings;
  settings.file = file;
  if (map.has("calibration")) settings.calibration = path_of(file, map.get<std::string>("calibration"));
  if (map.has("kalibr")) {
    for (const std::string& name : map.texts("kalibr")) settings.kalibr.push_back(path_of(file, name));
  }
  if (map.has("settings")) settings.estimator = load_config(path_of(file, map.get<std::string>("settings")));
  if (map.has("budget_ms")) {
    settings.budget_ms = map.get<double>("budget_ms");
    if (*settings.budget_ms < 0.0) throw map.error("budget_ms", "must not be negative; 0: no budget");
  }
  const int slots = map.get_or("frame_slots", static_cast<int>(settings.frame_slots));
  if (slots < 1 || slots > 64) throw map.error("frame_slots", "1 to 64 expected");
  settings.frame_slots = static_cast<std::size_t>(slots);
  if (map.has("mavlink")) {
    for (const YamlMap& line : map.children("mavlink")) settings.mavlink.push_back(load_mavlink(line));
  }
  if (map.has("cameras")) settings.cameras = load_cameras(map.child("cameras"), file);
  if (map.has("ros")) settings.ros = load_ros(map.child("ros"));
  if (map.has("topics") && !settings.ros) throw map.error("topics", "without `ros`, which reads them");
  settings.log.level = LogLevel::info;
  if (map.has("log")) settings.log = load_log(map.child("log"), file);
  return settings;
}

double default_budget_ms(const Calibration& calibration) {
  if (calibration.cameras.empty() || calibration.cameras.front().rate_hz <= 0.0) return 0.0;
  return 1e3 * kBudgetShare / calibration.cameras.front().rate_hz;
}

}  // namespace ear::live
