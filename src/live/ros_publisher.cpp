#include "src/live/ros_publisher.h"

#include "src/ros2/cdr.h"

namespace ear::live {

RosPublisher::RosPublisher(const dds::Participant& participant, RosMessages messages, OnMessage on_message)
    : messages_(std::move(messages)),
      on_message_(std::move(on_message)),
      path_(messages_.names().odom_frame),
      odometry_(participant, messages_.names().odometry, ros2::Odometry::kType, {}),
      diagnostics_(participant, messages_.names().diagnostics, ros2::DiagnosticArray::kType, {}) {
  const RosNames& names = messages_.names();
  if (!names.predicted.empty())
    predicted_.emplace(participant, names.predicted, ros2::Odometry::kType, dds::Writer::Options{});
  if (names.tf) tf_.emplace(participant, "/tf", ros2::TfMessage::kType, dds::Writer::Options{true, false, 100});
  if (!names.path.empty())
    path_writer_.emplace(participant, names.path, ros2::Path::kType, dds::Writer::Options{true, false, 1});
}

template <typename Message>
void RosPublisher::write(dds::Writer& writer, const std::string& topic, TimeNs t_ns, const Message& message) {
  const std::vector<std::uint8_t> cdr = ros2::encode(message);
  writer.write(cdr);
  if (on_message_) on_message_(topic, Message::kType, t_ns, cdr);
}

void RosPublisher::take(const ImuSample& sample, const std::optional<NavState>& state) {
  if (!predicted_ || !state) return;
  predicted_->write(ros2::encode(messages_.odometry(*state, sample.gyro_B - state->b_g, nullptr)));
}

void RosPublisher::take(const LiveFrame& frame) {
  {
    const std::lock_guard lock(mutex_);
    health_ = frame.health;
  }
  if (!frame.estimate || frame.status != Status::tracking) return;
  const NavState& state = frame.estimate->state;
  const ros2::Odometry message = messages_.odometry(state, gyro_B_ - state.b_g, &*frame.estimate);
  write(odometry_, messages_.names().odometry, state.t_ns, message);
  if (tf_) write(*tf_, "/tf", state.t_ns, messages_.transform(message));
  const ros2::Path* const path = path_writer_ && path_writer_->is_read() ? path_.add(message) : nullptr;
  if (path != nullptr) path_writer_->write(ros2::encode(*path));
}

void RosPublisher::tell(TimeNs t_ns, const std::string& rates) {
  Health health;
  {
    const std::lock_guard lock(mutex_);
    health = health_;
  }
  diagnostics_.write(ros2::encode(messages_.diagnostics(t_ns, health, rates)));
}

}  // namespace ear::live
