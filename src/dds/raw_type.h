// A DDS type whose samples are bytes as they go over the wire, so that one decoder (src/ros2/cdr.h) serves wire and
// files.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

struct ddsi_sertype;  // NOLINT(readability-identifier-naming): Cyclone's name
struct ddsi_serdata;  // NOLINT(readability-identifier-naming)

namespace ear::dds {

/// The name of a ROS type on the wire: "sensor_msgs::msg::dds_::Imu_" for "sensor_msgs/msg/Imu".
[[nodiscard]] std::string wire_type(const std::string& type);
/// The other way; other names stay as they are.
[[nodiscard]] std::string ros_type(const std::string& wire_type);
/// The name of a ROS topic on the wire: "rt/imu" for "/imu".
[[nodiscard]] std::string wire_topic(const std::string& topic);

/// A new type of this name on the wire; Cyclone counts who uses it.
[[nodiscard]] ddsi_sertype* make_raw_type(const std::string& wire_type);

/// One sample to write: CDR with its header of four bytes.
[[nodiscard]] ddsi_serdata* make_raw_data(const ddsi_sertype* type, const std::vector<std::uint8_t>& bytes);

/// The bytes of a sample of such a type, as long as it is not given back.
struct RawBytes {
  const std::uint8_t* data = nullptr;
  std::size_t size = 0;
};
[[nodiscard]] RawBytes bytes_of(const ddsi_serdata* data);
void give_back(ddsi_serdata* data);

}  // namespace ear::dds
