// A recording to an MCAP file.
#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "ear/calibration.h"
#include "ear/types.h"
#include "src/recording/recording.h"
#include "src/ros2/topics.h"

namespace ear::rosbag2 {

/// Writes samples as messages, and what describes the sensors: CameraInfo and tf_static at the beginning, and the
/// sensor.yaml files as attachments. Messages carry their sensor's stamp; the log's time is when they arrived, by which
/// the file is ordered. Throws InputError, naming the file.
class RecordingWriter {
 public:
  /// `calibration_folder`: has <sensor>/sensor.yaml for the attachments; those that are there are taken.
  RecordingWriter(const std::filesystem::path& file, const ros2::SensorTopics& topics, const Calibration& calibration,
                  const std::filesystem::path& calibration_folder);
  ~RecordingWriter();
  RecordingWriter(RecordingWriter&&) noexcept;
  RecordingWriter& operator=(RecordingWriter&&) noexcept;

  void write(const Sample& sample);
  void write_truth(TimeNs t_ns, const Eigen::Quaterniond& q_WB, const Eigen::Vector3d& p_WB);
  /// Any other message: CDR with its header, of a time.
  void write_message(const std::string& topic, const std::string& type, TimeNs t_ns,
                     const std::vector<std::uint8_t>& cdr);
  /// Completes the file.
  void close();

 private:
  class Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace ear::rosbag2
