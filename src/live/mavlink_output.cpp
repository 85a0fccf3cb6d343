#include "src/live/mavlink_output.h"

#include "src/log/log.h"

namespace ear::live {

MavlinkOutput::MavlinkOutput(mavlink::Link& link, const Eigen::Matrix3d& R_BV, const ImuCalibration& imu)
    : link_(link), stream_(R_BV, imu) {
  announce(mavlink::LinkHealth::starting, {});
}

void MavlinkOutput::take(const LiveSample& sample) {
  add_imu(sample.imu);
  if (sample.state && wants_prediction(sample.state->t_ns)) send_prediction(*sample.state);
}

void MavlinkOutput::take(const LiveFrame& frame) {
  const auto message = stream_.add_frame(frame.estimate, frame.status);
  announce(stream_.health(), frame.health.faulty);
  if (message) link_.send(*message);
  const std::uint64_t dropped = link_.counts().dropped;
  if (dropped == dropped_) return;
  dropped_ = dropped;
  if (const auto held_back = log_limit_.allows("dropped", frame.t_ns)) {
    log_warning("mavlink: " + std::to_string(dropped) + " messages not taken so far" + held_back_text(*held_back));
  }
}

void MavlinkOutput::announce(mavlink::LinkHealth health, const SourceSet& faulty) {
  const mavlink::StatusText text = mavlink::to_text(health, faulty);
  if (text.text == announced_) return;
  announced_ = text.text;
  log_info("mavlink: says " + std::string(text.text));
  link_.set_state(mavlink::to_system_state(health));
  link_.send(text);
}

}  // namespace ear::live
