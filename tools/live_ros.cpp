#include "tools/live_ros.h"

#include <chrono>
#include <mutex>
#include <thread>

#include "src/live/ros_calibration.h"
#include "src/live/ros_publisher.h"
#include "src/live/ros_sensors.h"
#include "src/log/log.h"
#include "src/recording/input_error.h"

namespace ear::tools {
namespace {

constexpr double kWait = 0.2;                          // [s] between two looks
constexpr std::chrono::milliseconds kDiscovery{1500};  // until the topics of a running vehicle are known

bool states_all(const ros2::SensorTopics& topics) {
  return (!topics.imu.empty() || topics.imu_apart()) && !topics.left.empty();
}

}  // namespace

class LiveRos::Impl {
 public:
  explicit Impl(const live::LiveSettings& settings)
      : settings_(*settings.ros),
        topics_(ros2::load_sensor_topics(settings.file)),
        participant_(settings_.domain ? *settings_.domain : dds::domain_of_environment()) {
    if (states_all(topics_)) return;
    std::this_thread::sleep_for(kDiscovery);
    std::vector<std::string> notes;
    topics_ = ros2::guess_topics(topics_, live::topics_of(participant_), notes);
    for (const std::string& note : notes) log_info("topics: " + note);
    if (!topics_.imu.empty() || topics_.imu_apart()) return;
    throw InputError(located(settings.file, 0, "topics", "no topic of an IMU is stated, and none is published now"));
  }

  std::optional<Calibration> complete(const Calibration& known, const std::function<bool()>& stop) {
    ros2::SensorTopics needed = topics_;
    if (!known.cameras.empty()) needed.left = needed.right = "";
    if (known.lasers) needed.beams = {};
    live::RosCalibration messages(participant_, needed);
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

  void publish(const Calibration& calibration, LiveRos::OnMessage on_message) {
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
    publisher_.emplace(participant_, live::RosMessages(settings_.names, T_B_base), std::move(on_message));
  }

  void start(live::Intake& intake) { sensors_.emplace(participant_, topics_, intake); }
  void stop() { sensors_.reset(); }

  template <typename... What>
  void send(const What&... what) {
    if (publisher_) publisher_->take(what...);
  }
  void tell(TimeNs t_ns, const std::string& rates) {
    if (publisher_) publisher_->tell(t_ns, rates);
  }
  std::vector<std::string> look() { return sensors_ ? sensors_->look() : std::vector<std::string>{}; }

 private:
  live::RosSettings settings_;
  ros2::SensorTopics topics_;
  dds::Participant participant_;
  std::optional<Eigen::Isometry3d> T_B_base_;
  std::optional<live::RosPublisher> publisher_;
  std::optional<live::RosSensors> sensors_;  ///< last: its threads use the publisher
};

LiveRos::LiveRos(const live::LiveSettings& settings) : impl_(std::make_unique<Impl>(settings)) {}
LiveRos::~LiveRos() = default;

std::optional<Calibration> LiveRos::complete(const Calibration& known, const std::function<bool()>& stop) {
  return impl_->complete(known, stop);
}
void LiveRos::publish(const Calibration& calibration, OnMessage on_message) {
  impl_->publish(calibration, std::move(on_message));
}
void LiveRos::start(live::Intake& intake) { impl_->start(intake); }
void LiveRos::stop() { impl_->stop(); }
void LiveRos::take(const ImuSample& sample, const std::optional<NavState>& state) { impl_->send(sample, state); }
void LiveRos::take(const live::LiveSample& sample) { impl_->send(sample); }
void LiveRos::take(const live::LiveFrame& frame) { impl_->send(frame); }
std::vector<std::string> LiveRos::look() { return impl_->look(); }
void LiveRos::tell(TimeNs t_ns, const std::string& rates) { impl_->tell(t_ns, rates); }

std::string missing_ros_parts() { return ""; }

}  // namespace ear::tools
