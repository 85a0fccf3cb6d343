#include "src/recording/input_error.h"
#include "tools/live_ros.h"

namespace ear::tools {

class LiveRos::Impl {};

LiveRos::LiveRos(const live::LiveSettings& settings) {
  throw InputError(located(settings.file, 0, "ros", missing_ros_parts()));
}
LiveRos::~LiveRos() = default;

std::optional<Calibration> LiveRos::complete(const Calibration& /*known*/, const std::function<bool()>& /*stop*/) {
  return std::nullopt;
}
void LiveRos::publish(const Calibration& /*calibration*/, OnMessage /*on_message*/) {}
void LiveRos::start(live::Intake& /*intake*/) {}
void LiveRos::stop() {}
void LiveRos::take(const ImuSample& /*sample*/, const std::optional<NavState>& /*state*/) {}
void LiveRos::take(const live::LiveSample& /*sample*/) {}
void LiveRos::take(const live::LiveFrame& /*frame*/) {}
std::vector<std::string> LiveRos::look() { return {}; }
void LiveRos::tell(TimeNs /*t_ns*/, const std::string& /*rates*/) {}

std::string missing_ros_parts() {
  return "topics of ROS 2 are not built in: install libfastcdr-dev and cyclonedds-dev, and build again";
}

}  // namespace ear::tools
