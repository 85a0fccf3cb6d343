#include "src/live/ros_node.h"

#include <algorithm>
#include <chrono>
#include <mutex>
#include <thread>

#include "src/dds/log_sink.h"
#include "src/live/ros_calibration.h"
#include "src/live/ros_publisher.h"
#include "src/live/ros_sensors.h"
#include "src/log/log.h"
#include "src/log/repeat_limit.h"
#include "src/recording/input_error.h"

namespace ear::live {
namespace {

constexpr double kWait = 0.2;                          // [s] between two looks
constexpr std::chrono::milliseconds kDiscovery{1500};  // until the topics of a running vehicle are known

bool states_all(const ros2::SensorTopics& topics) {
  return (!topics.imu.empty() || topics.imu_apart()) && !topics.left.empty();
}

}  // namespace

class RosNode::Impl {
 public:
  Impl(const LiveSettings& settings, bool reads)
      : settings_(*settings.ros),
        topics_(ros2::load_sensor_topics(settings.file)),
        participant_(settings_.domain ? *settings_.domain : dds::domain_of_environment()) {
    if (!reads || states_all(topics_)) return;
    std::this_thread::sleep_for(kDiscovery);
    std::vector<std::string> notes;
    topics_ = ros2::guess_topics(topics_, topics_of(participant_), notes);
    for (const std::string& note : notes) log_info("topics: " + note);
    if (!topics_.imu.empty() || topics_.imu_apart()) return;
    throw InputError(located(settings.file, 0, "topics", "no topic of an IMU is stated, and none is published now"));
  }

  std::optional<Calibration> complete(const Calibration& known, const std::function<bool()>& stop) {
    ros2::SensorTopics needed = topics_;
    if (!known.cameras.empty()) needed.left = needed.right = "";
    if (known.lasers) needed.beams = {};
    RosCalibration messages(participant_, needed);
    std::string said;
    for (std::string missing = messages.wait(kWait); !missing.empty(); missing = messages.wait(kWait)) {
      for (const std::string& words : messages.look()) log_warning(words);
      if (missing != said) log_warning("calibration: waiting for " + missing);
      said = missing;
      if (stop()) return std::nullopt;
    }
    T_B_base_ = messages.T_B_base();
    return messages.complete(known);
  }

  void publish(const Calibration& calibration, RosNode::OnMessage on_message) {
    if (!settings_.publish) return;
    Eigen::Isometry3d T_B_base = Eigen::Isometry3d::Identity();
    if (calibration.encoder) {
      T_B_base = calibration.encoder->T_BO;
    } else if (T_B_base_) {
      T_B_base = *T_B_base_;
    } else {
      log_warning("ros: neither wheels nor tf_static say where " + settings_.names.base_frame +
                  " is: the IMU's frame stands for it");
    }
    const RosMessages messages(settings_.names, T_B_base);
    publisher_.emplace(participant_, messages, std::move(on_message));
    if (!settings_.names.features.empty() && !calibration.cameras.empty()) {
      publisher_->publish_features(participant_, calibration.cameras.front());
    }
    if (!settings_.names.tf_static || is_published(topics_.tf_static)) return;
    publisher_->publish_frames(participant_, messages.frames(calibration, clock_.now()));
  }

  [[nodiscard]] bool is_published(const std::string& topic) const {
    const std::vector<dds::Publication> all = participant_.publications();
    return std::any_of(all.begin(), all.end(), [&](const dds::Publication& one) { return one.topic == topic; });
  }

  void start(Intake& intake) { sensors_.emplace(participant_, topics_, intake); }
  void stop() { sensors_.reset(); }

  template <typename... What>
  void send(const What&... what) {
    if (publisher_) publisher_->take(what...);
  }
  void show(const Odometry& odometry) {
    if (publisher_) publisher_->show(odometry);
  }
  void publish_status(TimeNs t_ns, const std::string& rates) {
    if (publisher_) publisher_->publish_status(t_ns, rates);
  }
  std::vector<std::string> look() {
    std::vector<std::string> words = sensors_ ? sensors_->look() : std::vector<std::string>{};
    for (const std::string& text : dds_words_.take()) {
      if (const auto held_back = dds_limit_.allows("", clock_.now())) {
        words.push_back("DDS: " + text + held_back_text(*held_back));
      }
    }
    return words;
  }

 private:
  LiveClock clock_;
  Complaints dds_words_;
  RepeatLimit dds_limit_{10.0};
  dds::LogSink sink_{[this](const std::string& text) { dds_words_.add(text); }};
  RosSettings settings_;
  ros2::SensorTopics topics_;
  dds::Participant participant_;
  std::optional<Eigen::Isometry3d> T_B_base_;
  std::optional<RosPublisher> publisher_;
  std::optional<RosSensors> sensors_;  ///< last: its threads use the publisher
};

RosNode::RosNode(const LiveSettings& settings, bool reads) : impl_(std::make_unique<Impl>(settings, reads)) {}
RosNode::~RosNode() = default;

std::optional<Calibration> RosNode::complete(const Calibration& known, const std::function<bool()>& stop) {
  return impl_->complete(known, stop);
}
void RosNode::publish(const Calibration& calibration, OnMessage on_message) {
  impl_->publish(calibration, std::move(on_message));
}
void RosNode::start(Intake& intake) { impl_->start(intake); }
void RosNode::stop() { impl_->stop(); }
void RosNode::take(const ImuSample& sample, const std::optional<NavState>& state) { impl_->send(sample, state); }
void RosNode::take(const LiveSample& sample) { impl_->send(sample); }
void RosNode::take(const LiveFrame& frame) { impl_->send(frame); }
void RosNode::show(const Odometry& odometry) { impl_->show(odometry); }
void RosNode::take(const StereoFrame& frame) { impl_->send(frame); }
std::vector<std::string> RosNode::look() { return impl_->look(); }
void RosNode::publish_status(TimeNs t_ns, const std::string& rates) { impl_->publish_status(t_ns, rates); }

std::string missing_ros_parts() { return ""; }

}  // namespace ear::live
