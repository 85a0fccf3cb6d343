#include "src/live/ros_node.h"
#include "src/recording/input_error.h"

namespace ear::live {

class RosNode::Impl {};

RosNode::RosNode(const LiveSettings& settings, bool /*reads*/) {
  throw InputError(located(settings.file, 0, "ros", missing_ros_parts()));
}
RosNode::~RosNode() = default;

std::optional<Calibration> RosNode::complete(const Calibration& /*known*/, const std::function<bool()>& /*stop*/) {
  return std::nullopt;
}
void RosNode::publish(const Calibration& /*calibration*/, OnMessage /*on_message*/) {}
void RosNode::start(Intake& /*intake*/) {}
void RosNode::stop() {}
void RosNode::take(const ImuSample& /*sample*/, const std::optional<NavState>& /*state*/) {}
void RosNode::take(const LiveSample& /*sample*/) {}
void RosNode::take(const LiveFrame& /*frame*/) {}
void RosNode::show(const Odometry& /*odometry*/) {}
void RosNode::take(const StereoFrame& /*frame*/) {}
std::vector<std::string> RosNode::look() { return {}; }
void RosNode::publish_status(TimeNs /*t_ns*/, const std::string& /*rates*/) {}

std::string missing_ros_parts() {
  return "topics of ROS 2 are not built in: install libfastcdr-dev and cyclonedds-dev, and build again";
}

}  // namespace ear::live
