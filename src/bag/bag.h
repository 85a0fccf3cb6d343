// ROS 1 bags, where Debian's librosbag-storage-dev is: samples into a bag, and a bag into a recording's folder.
#pragma once

#include <Eigen/Geometry>
#include <filesystem>
#include <memory>

#include "ear/calibration.h"
#include "ear/types.h"
#include "src/bag/topics.h"

namespace ear {

/// Whether this program was built with them. Without, everything below throws InputError that says what is missing.
[[nodiscard]] bool bags_are_built();

/// Writes samples as messages: see BagTopics. Messages carry their sensor's stamp; `arrival_ns` orders them. Throws
/// InputError, naming the file, for what a bag cannot hold.
class BagWriter {
 public:
  /// `encoder`: what a count is worth; nothing on a vehicle without wheels.
  BagWriter(const std::filesystem::path& file, const BagTopics& topics, const Calibration& calibration);
  ~BagWriter();
  BagWriter(BagWriter&&) noexcept;
  BagWriter& operator=(BagWriter&&) noexcept;

  void write(const ImuSample& sample);
  void write(const EncoderSample& sample);
  void write(const LaserSample& sample);
  void write(const StereoFrame& frame, TimeNs arrival_ns);
  void write_truth(TimeNs t_ns, const Eigen::Quaterniond& q_WB, const Eigen::Vector3d& p_WB);
  /// Completes the file.
  void close();

 private:
  class Impl;
  std::unique_ptr<Impl> impl_;
};

/// Writes the messages of a bag to `folder`/mav0 as docs/recordings.md has it, with the sensors' calibration, so that
/// Recording can read them. Throws InputError, naming file and topic: no inertial samples, a message of another type,
/// an image that is not 8-bit grey, wheels or beams without a calibration.
void unpack_bag(const std::filesystem::path& bag, const BagTopics& topics, const std::filesystem::path& folder);

}  // namespace ear
