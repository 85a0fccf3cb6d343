// Bags of ROS 2 for the ear program, whether or not it was built with them.
#pragma once

#include <Eigen/Geometry>
#include <filesystem>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "src/recording/recording.h"
#include "src/recording/sample_source.h"

namespace ear {

/// Whether this program was built with them. Without, all but is_ros2_bag() throws InputError that says what is
/// missing.
[[nodiscard]] bool ros2_bags_are_built();

/// FILE.mcap, FILE.db3, either with .zstd behind it, or a folder with such files or rosbag2's metadata.yaml.
[[nodiscard]] bool is_ros2_bag(const std::filesystem::path& path);

/// A bag as a source of samples. `config`: settings that may name its topics; empty: they are guessed. `notes` gets a
/// line for each guess. Throws InputError.
[[nodiscard]] std::unique_ptr<SampleSource> open_ros2_bag(const std::filesystem::path& bag,
                                                          const std::filesystem::path& config,
                                                          const RecordingOptions& options,
                                                          std::vector<std::string>& notes);

/// A pose of the truth.
struct TruePose {
  TimeNs t_ns = 0;
  Eigen::Quaterniond q_WB = Eigen::Quaterniond::Identity();
  Eigen::Vector3d p_WB = Eigen::Vector3d::Zero();
};

/// Writes a recording to an MCAP file, with topics as ros2::default_topics() names them. `calibration_folder` has the
/// sensors' sensor.yaml, `truth` is in the order of time, `progress` is told how many samples are written. Returns how
/// many they are. Throws InputError.
std::size_t write_mcap(Recording& recording, const std::filesystem::path& file,
                       const std::filesystem::path& calibration_folder, const std::vector<TruePose>& truth,
                       const std::function<void(std::size_t)>& progress);

}  // namespace ear
