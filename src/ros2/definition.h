// The text of a message's definition, as bags carry it (encoding "ros2msg"): its fields, and below a line of = those of
// the types within.
#pragma once

#include <string>

namespace ear::ros2 {

/// "" for a type that messages.h does not have. `type`: "sensor_msgs/msg/Imu".
[[nodiscard]] std::string definition_of(const std::string& type);

}  // namespace ear::ros2
