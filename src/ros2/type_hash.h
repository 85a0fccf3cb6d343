// The hash by which ROS 2 distributions since Iron tell whether two ends mean the same type (REP-2016, RIHS01).
#pragma once

#include <string>

namespace ear::ros2 {

/// "RIHS01_" and 64 hexadecimal digits; "" for a type that is not sent. `type`: "nav_msgs/msg/Odometry".
[[nodiscard]] std::string type_hash_of(const std::string& type);

}  // namespace ear::ros2
