#include "src/live/ros_publisher.h"

#include <utility>

#include "src/ros2/cdr.h"
#include "src/ros2/type_hash.h"

namespace ear::live {
namespace {

/// Newer distributions look in the writer's user data for the hash of its type.
template <typename Message>
dds::Writer writer_of(const dds::Participant& participant, const std::string& topic, int depth = 10,
                      bool transient_local = false) {
  const std::string hash = ros2::type_hash_of(Message::kType);
  return {participant, topic, Message::kType, {true, transient_local, depth, "typehash=" + hash + ";"}};
}

}  // namespace

RosPublisher::RosPublisher(const dds::Participant& participant, RosMessages messages, OnMessage on_message)
    : messages_(std::move(messages)),
      on_message_(std::move(on_message)),
      path_(messages_.names().odom_frame),
      odometry_(writer_of<ros2::Odometry>(participant, messages_.names().odometry)),
      diagnostics_(writer_of<ros2::DiagnosticArray>(participant, messages_.names().diagnostics)) {
  const RosNames& names = messages_.names();
  if (!names.predicted.empty()) predicted_ = writer_of<ros2::Odometry>(participant, names.predicted);
  if (names.tf) tf_ = writer_of<ros2::TfMessage>(participant, "/tf", 100);
  if (!names.path.empty()) path_writer_ = writer_of<ros2::Path>(participant, names.path, 1);
}

void RosPublisher::publish_frames(const dds::Participant& participant, const ros2::TfMessage& frames) {
  frames_ = writer_of<ros2::TfMessage>(participant, "/tf_static", 1, true);
  frames_->write(ros2::encode(frames));
}

void RosPublisher::publish_features(const dds::Participant& participant, const CameraCalibration& left) {
  features_ = writer_of<ros2::Image>(participant, messages_.names().features, 2);
  feature_images_ = std::make_unique<FeatureImages>(left);
}

void RosPublisher::take(const StereoFrame& frame) {
  if (!feature_images_) return;
  feature_images_->want(features_->is_read());
  feature_images_->take(frame);
}

void RosPublisher::show(const Odometry& odometry) {
  if (!feature_images_ || !feature_images_->wanted()) return;
  if (const auto image = feature_images_->draw(odometry.features())) features_->write(ros2::encode(*image));
}

template <typename Message>
void RosPublisher::write(dds::Writer& writer, const std::string& topic, TimeNs t_ns, const Message& message) {
  const std::vector<std::uint8_t> cdr = ros2::encode(message);
  writer.write(cdr);
  if (on_message_) on_message_(topic, Message::kType, t_ns, cdr);
}

void RosPublisher::take(const ImuSample& sample, const std::optional<NavState>& state) {
  if (!predicted_ || !state) return;
  write(*predicted_, messages_.names().predicted, state->t_ns,
        messages_.odometry(*state, sample.gyro_B - state->b_g, nullptr));
}

void RosPublisher::take(const LiveFrame& frame) {
  {
    const std::lock_guard lock(mutex_);
    health_ = frame.health;
  }
  if (!frame.estimate || frame.status != Status::tracking) return;
  const NavState& state = frame.estimate->state;
  const ros2::Odometry message = messages_.odometry(state, rates_.gyro_B(state.t_ns) - state.b_g, &*frame.estimate);
  write(odometry_, messages_.names().odometry, state.t_ns, message);
  if (tf_) write(*tf_, "/tf", state.t_ns, messages_.transform(message));
  const ros2::Path* const path = path_writer_ && path_writer_->is_read() ? path_.add(message) : nullptr;
  if (path != nullptr) write(*path_writer_, messages_.names().path, state.t_ns, *path);
}

void RosPublisher::publish_status(TimeNs t_ns, const std::string& rates) {
  Health health;
  {
    const std::lock_guard lock(mutex_);
    health = health_;
  }
  write(diagnostics_, messages_.names().diagnostics, t_ns, messages_.diagnostics(t_ns, health, rates));
}

}  // namespace ear::live
