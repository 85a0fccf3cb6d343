// Which topics of a ROS bag are which sensors: the map `topics` of a configuration file.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

namespace ear {

/// Defaults are the names in EuRoC's bags, and for wheels and lasers those that `ear export` gives.
struct BagTopics {
  std::string imu = "/imu0";              ///< sensor_msgs/Imu
  std::string left = "/cam0/image_raw";   ///< sensor_msgs/Image or CompressedImage
  std::string right = "/cam1/image_raw";  ///< the same
  std::string wheels = "/wheels";         ///< sensor_msgs/JointState: angles of the left and the right wheel [rad]
  std::vector<std::string> beams{"/laser/0", "/laser/1", "/laser/2"};  ///< sensor_msgs/Range, in laser0's order
  std::string truth = "/truth";                                        ///< geometry_msgs/PoseStamped; written, not read
  std::filesystem::path calibration;  ///< folder with <sensor>/sensor.yaml; empty: the bag's name, .calibration
};

/// The map `topics` of a configuration file; what it leaves out keeps its default, and so does a file without it.
/// Throws InputError, naming file, line and key.
[[nodiscard]] BagTopics load_topics(const std::filesystem::path& config_file);

/// Where the sensors' calibration of a bag is: a recording's mav0 without its data.
[[nodiscard]] std::filesystem::path calibration_folder(const std::filesystem::path& bag, const BagTopics& topics);

}  // namespace ear
