// A bag of ROS 2 as a source of samples: streamed, nothing is unpacked to disk but files that are compressed whole.
#pragma once

#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "src/recording/sample_source.h"
#include "src/ros2/topics.h"

namespace ear::rosbag2 {

/// `stated`: what the configuration says of topics; the rest is guessed, and `notes` says how. Throws InputError: no
/// inertial samples, a topic that is stated and not there, wheels or cameras that cannot be used.
[[nodiscard]] std::unique_ptr<SampleSource> open_bag(const std::filesystem::path& bag, const ros2::SensorTopics& stated,
                                                     const RecordingOptions& options, std::vector<std::string>& notes);

}  // namespace ear::rosbag2
