// Which topics of ROS 2 carry what, and the words about messages that could not be used.
#pragma once

#include <mutex>
#include <string>
#include <vector>

#include "src/dds/participant.h"
#include "src/ros2/topics.h"

namespace ear::live {

/// Messages that could not be used, for another thread to say; any thread.
class Complaints {
 public:
  void add(const std::string& words);
  [[nodiscard]] std::vector<std::string> take();

 private:
  std::mutex mutex_;
  std::vector<std::string> words_;
};

/// What to subscribe to, with the type that the topic is published with now, among those that can be read.
[[nodiscard]] dds::Wanted image_topic(const dds::Participant& participant, const std::string& topic);
[[nodiscard]] dds::Wanted beam_topic(const dds::Participant& participant, const std::string& topic);
/// One, or gyroscope and accelerometer; without a name if none is stated.
[[nodiscard]] std::vector<dds::Wanted> imu_topics(const ros2::SensorTopics& topics);
[[nodiscard]] dds::Wanted wheel_topic(const std::string& topic);

/// Those of the beams that are stated.
[[nodiscard]] std::vector<std::string> beam_topics(const ros2::SensorTopics& topics);

/// Which topics there are now, for ros2::guess_topics().
[[nodiscard]] std::vector<ros2::Topic> topics_of(const dds::Participant& participant);

}  // namespace ear::live
