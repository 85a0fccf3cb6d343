#include "src/live/ros_topics.h"

#include <algorithm>
#include <iterator>
#include <utility>

#include "src/ros2/messages.h"

namespace ear::live {
namespace {

constexpr std::size_t kMostComplaints = 20;  // that wait to be said
constexpr int kSampleDepth = 2000;           // messages of a quick sensor that wait for its thread: 10 s at 200 Hz
constexpr int kImageDepth = 4;

const char* const kImuType = ros2::Imu::kType;

/// The type that a topic is published with now, among those that can be read; the first one, if it is not published.
std::string type_of(const dds::Participant& participant, const std::string& topic,
                    const std::vector<std::string>& known) {
  for (const dds::Publication& one : participant.publications()) {
    if (one.topic == topic && std::count(known.begin(), known.end(), one.type) > 0) return one.type;
  }
  return known.front();
}

}  // namespace

void Complaints::add(const std::string& words) {
  const std::lock_guard lock(mutex_);
  if (words_.size() < kMostComplaints) words_.push_back(words);
}

std::vector<std::string> Complaints::take() {
  const std::lock_guard lock(mutex_);
  return std::exchange(words_, {});
}

dds::Wanted image_topic(const dds::Participant& participant, const std::string& topic) {
  return {topic, type_of(participant, topic, {ros2::Image::kType, ros2::CompressedImage::kType}), kImageDepth};
}

dds::Wanted beam_topic(const dds::Participant& participant, const std::string& topic) {
  return {topic, type_of(participant, topic, {ros2::Range::kType, ros2::LaserScan::kType}), kSampleDepth};
}

std::vector<dds::Wanted> imu_topics(const ros2::SensorTopics& topics) {
  if (!topics.imu_apart()) return {{topics.imu, kImuType, kSampleDepth}};
  return {{topics.gyro, kImuType, kSampleDepth}, {topics.accel, kImuType, kSampleDepth}};
}

dds::Wanted wheel_topic(const std::string& topic) { return {topic, ros2::JointState::kType, kSampleDepth}; }

std::vector<std::string> beam_topics(const ros2::SensorTopics& topics) {
  std::vector<std::string> beams;
  std::copy_if(topics.beams.begin(), topics.beams.end(), std::back_inserter(beams),
               [](const std::string& beam) { return !beam.empty(); });
  return beams;
}

std::vector<ros2::Topic> topics_of(const dds::Participant& participant) {
  std::vector<ros2::Topic> topics;
  for (const dds::Publication& one : participant.publications()) topics.push_back({one.topic, one.type});
  return topics;
}

}  // namespace ear::live
