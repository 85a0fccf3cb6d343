// Messages to the bytes of the wire and of bags, and back: XCDR1 with its header of four bytes, by eProsima's Fast CDR.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "src/recording/input_error.h"
#include "src/ros2/messages.h"

namespace ear::ros2 {

/// Bytes that are not the message they should be. what(): type, field and reason.
class CdrError : public InputError {
 public:
  using InputError::InputError;
};

/// A message's bytes, borrowed.
struct Bytes {
  const std::uint8_t* data = nullptr;
  std::size_t size = 0;
};

enum class ByteOrder { little, big };

/// The bytes of a message. Defined for every struct of messages.h that is a topic's type: Image, CompressedImage,
/// CameraInfo, Imu, JointState, Range, LaserScan, TfMessage, Odometry, Path, PoseStamped, DiagnosticArray, Header,
/// Text.
template <typename Message>
[[nodiscard]] std::vector<std::uint8_t> encode(const Message& message, ByteOrder order = ByteOrder::little);

/// The message that bytes hold, of either byte order; bytes behind its last field are passed over. A length that cannot
/// be takes no memory: no more than a fixed multiple of `bytes` is used. Throws CdrError.
template <typename Message>
[[nodiscard]] Message decode(Bytes bytes);

/// "sensor_msgs/msg/Imu" for that name, for "sensor_msgs/Imu", and for the name on the wire,
/// "sensor_msgs::msg::dds_::Imu_".
[[nodiscard]] std::string canonical_type(const std::string& name);

}  // namespace ear::ros2
