#include "src/ros2/messages.h"

#include <limits>
#include <string>

#include "src/recording/input_error.h"

namespace ear::ros2 {

Time time_of_stamp(TimeNs t_ns) {
  constexpr TimeNs kSecond = 1'000'000'000;
  if (t_ns < 0 || t_ns / kSecond > std::numeric_limits<std::int32_t>::max()) {
    throw InputError("a message of ROS 2 cannot hold the time " + std::to_string(t_ns) + " ns");
  }
  return {static_cast<std::int32_t>(t_ns / kSecond), static_cast<std::uint32_t>(t_ns % kSecond)};
}

}  // namespace ear::ros2
