// ROS 2 in `ear live`: its sensors, its calibration, its outputs; or words about how to get it where it is not built.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "src/live/intake.h"
#include "src/live/live_settings.h"

namespace ear::live {

class RosNode {
 public:
  /// Joins the domain and, if it is to read them, finds the topics of the sensors. Throws InputError, also where this
  /// is not built.
  RosNode(const LiveSettings& settings, bool reads);
  ~RosNode();
  RosNode(const RosNode&) = delete;
  RosNode& operator=(const RosNode&) = delete;
  RosNode(RosNode&&) = delete;
  RosNode& operator=(RosNode&&) = delete;

  /// `known`, with what it has not from CameraInfo, tf_static and the messages. Waits for these until `stop` says so;
  /// then nothing.
  [[nodiscard]] std::optional<Calibration> complete(const Calibration& known, const std::function<bool()>& stop);

  /// What goes out; before start(). `on_message` gets each message too: topic, type, stamp, CDR.
  using OnMessage =
      std::function<void(const std::string&, const std::string&, TimeNs, const std::vector<std::uint8_t>&)>;
  void publish(const Calibration& calibration, OnMessage on_message);
  /// Begins to read; once.
  void start(Intake& intake);
  /// Reads no more.
  void stop();

  /// By the inertial sensor's thread.
  void take(const ImuSample& sample, const std::optional<NavState>& state);
  /// By the estimator's thread.
  void take(const LiveSample& sample);
  void take(const LiveFrame& frame);
  void show(const Odometry& odometry);
  /// By the cameras' thread.
  void take(const StereoFrame& frame);
  /// By the main thread: what changed, in words; and once a second, the status for subscribers.
  [[nodiscard]] std::vector<std::string> look();
  void publish_status(TimeNs t_ns, const std::string& rates);

 private:
  class Impl;
  std::unique_ptr<Impl> impl_;
};

/// What of ROS 2 is not built, and which package brings it; empty: nothing is missing.
[[nodiscard]] std::string missing_ros_parts();

}  // namespace ear::live
