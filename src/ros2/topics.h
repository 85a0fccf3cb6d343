// Which topic is which sensor: the map `topics` of a configuration file, or a guess by the topics' types and names.
#pragma once

#include <array>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

namespace ear::ros2 {

/// "a, b, c".
[[nodiscard]] std::string joined(const std::vector<std::string>& names);

/// What a topic is called and what it carries ("sensor_msgs/msg/Imu").
struct Topic {
  std::string name;
  std::string type;
};

/// Empty names are sensors that are not there, or are still to be guessed.
struct SensorTopics {
  std::string imu;                       ///< sensor_msgs/Imu with rate and specific force
  std::string gyro, accel;               ///< instead: sensor_msgs/Imu with one of them each
  std::string left, right;               ///< sensor_msgs/Image or CompressedImage
  std::string left_info, right_info;     ///< sensor_msgs/CameraInfo; empty: camera_info beside the image
  std::string wheels;                    ///< sensor_msgs/JointState
  std::string left_joint, right_joint;   ///< names in it; empty: the first with "left" and "right", else the first two
  std::array<std::string, 3> beams;      ///< sensor_msgs/Range, or LaserScan of one beam
  std::string tf_static = "/tf_static";  ///< tf2_msgs/TFMessage
  std::string base_frame = "base_link";  ///< REP-105: the vehicle's frame in tf, x forward, z up
  std::string truth = "/truth";          ///< geometry_msgs/PoseStamped; written, not read
  std::filesystem::path calibration;     ///< folder with <sensor>/sensor.yaml, which override the topics

  [[nodiscard]] bool imu_apart() const { return imu.empty() && !gyro.empty() && !accel.empty(); }
  /// Beams that have a topic.
  [[nodiscard]] std::size_t beam_count() const;
};

/// The map `topics`; also those of ROS 1 bags (src/bag/topics.h), which has some of its keys. A file without it, and
/// a key that is left out, give empty names. Throws InputError, naming file, line and key.
[[nodiscard]] SensorTopics load_sensor_topics(const std::filesystem::path& config_file);

/// Fills what is empty by the types, and by names where several topics have one type. A topic's sensor is not guessed
/// where any of its kind is stated: with `left` stated, `right` stays empty, so that a mono camera can be asked for.
/// `notes` gets a line for each guess ("imu: /camera/imu (sensor_msgs/msg/Imu)"), and for choices that may be wrong.
[[nodiscard]] SensorTopics guess_topics(SensorTopics stated, const std::vector<Topic>& there,
                                        std::vector<std::string>& notes);

/// "/camera/infra1/camera_info" for "/camera/infra1/image_rect_raw".
[[nodiscard]] std::string info_topic_of(const std::string& image_topic);

/// What `ear export` writes and simulated vehicles publish: /imu0, /cam0/image_raw, /wheels, /laser/0, ...
[[nodiscard]] SensorTopics default_topics();

}  // namespace ear::ros2
