#include "src/bag/topics.h"

#include "src/recording/yaml_map.h"

namespace ear {

BagTopics load_topics(const std::filesystem::path& config_file) {
  BagTopics topics;
  const YamlMap file = YamlMap::load(config_file);
  if (!file.has("topics")) return topics;
  const YamlMap map = file.child("topics");
  topics.imu = map.get_or("imu", topics.imu);
  topics.left = map.get_or("left", topics.left);
  topics.right = map.get_or("right", topics.right);
  topics.wheels = map.get_or("wheels", topics.wheels);
  topics.truth = map.get_or("truth", topics.truth);
  for (std::size_t i = 0; i < topics.beams.size(); ++i) {
    topics.beams[i] = map.get_or("beam_" + std::to_string(i), topics.beams[i]);
  }
  topics.calibration = map.get_or("calibration", std::string());
  map.require_only({"imu", "left", "right", "wheels", "beam_0", "beam_1", "beam_2", "truth", "calibration"});
  if (topics.calibration.is_relative() && !topics.calibration.empty()) {
    topics.calibration = config_file.parent_path() / topics.calibration;
  }
  return topics;
}

std::filesystem::path calibration_folder(const std::filesystem::path& bag, const BagTopics& topics) {
  if (!topics.calibration.empty()) return topics.calibration;
  std::filesystem::path folder = bag;
  return folder.replace_extension(".calibration");
}

}  // namespace ear
