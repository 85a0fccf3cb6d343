#include "src/ros2/raw_message.h"

namespace ear::ros2 {

TimeNs stamp_of(const RawMessage& raw, const Header& header) {
  const bool unset = header.stamp.sec == 0 && header.stamp.nanosec == 0;
  const TimeNs t_ns = unset ? raw.received_ns : nanoseconds(header.stamp);
  if (t_ns <= -kLargestStamp || t_ns >= kLargestStamp) {
    throw InputError(raw.topic + ": header: " + std::to_string(t_ns) + " ns is no time");
  }
  return t_ns;
}

}  // namespace ear::ros2
