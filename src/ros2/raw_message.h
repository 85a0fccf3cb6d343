// A message as it came, from a bag or from the wire.
#pragma once

#include <string>

#include "ear/types.h"
#include "src/ros2/cdr.h"

namespace ear::ros2 {

struct RawMessage {
  std::string topic;
  std::string type;        ///< "sensor_msgs/msg/Imu"; any spelling that canonical_type() knows
  TimeNs received_ns = 0;  ///< when it was recorded or received: stands in for a stamp of 0
  Bytes bytes;             ///< with the four bytes of the representation; borrowed
};

/// The message, if it is of the type expected. Throws InputError, naming the topic, for another type or wrong bytes.
template <typename Message>
[[nodiscard]] Message decode(const RawMessage& raw) {
  const std::string type = canonical_type(raw.type);
  if (type != Message::kType) {
    throw InputError(raw.topic + ": is of type " + type + ", not " + Message::kType);
  }
  try {
    return decode<Message>(raw.bytes);
  } catch (const CdrError& error) {
    throw InputError(raw.topic + ": " + error.what());
  }
}

/// The sensor's stamp; without one, when the message was received. Throws InputError for what is no time.
[[nodiscard]] TimeNs stamp_of(const RawMessage& raw, const Header& header);

}  // namespace ear::ros2
