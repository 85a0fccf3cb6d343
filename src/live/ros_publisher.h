// Writes what ros_output.h makes of estimates to the wire.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <vector>

#include "src/dds/participant.h"
#include "src/live/feature_images.h"
#include "src/live/ros_output.h"
#include "src/rate_history.h"

namespace ear::live {

class RosPublisher {
 public:
  /// `participant` must outlive it. Throws std::runtime_error.
  /// `on_message` is told of all that is sent, if it is there: topic, type, stamp, CDR; by the threads that send.
  using OnMessage =
      std::function<void(const std::string&, const std::string&, TimeNs, const std::vector<std::uint8_t>&)>;
  RosPublisher(const dds::Participant& participant, RosMessages messages, OnMessage on_message);

  /// Where the sensors are, once: kept for those who join later.
  void publish_frames(const dds::Participant& participant, const ros2::TfMessage& frames);

  /// The left camera's images with their features, while somebody reads them; before the first image.
  void publish_features(const dds::Participant& participant, const CameraCalibration& left);
  /// By the cameras' thread; by the estimator's, after an image.
  void take(const StereoFrame& frame);
  void show(const Odometry& odometry);

  /// By the inertial sensor's thread, after each sample.
  void take(const ImuSample& sample, const std::optional<NavState>& state);
  /// By the estimator's thread: every sample, then what came of a frame.
  void take(const LiveSample& sample) { rates_.add(sample.imu); }
  void take(const LiveFrame& frame);
  /// By the main thread, once a second.
  void publish_status(TimeNs t_ns, const std::string& rates);

 private:
  template <typename Message>
  void write(dds::Writer& writer, const std::string& topic, TimeNs t_ns, const Message& message);

  RosMessages messages_;
  OnMessage on_message_;
  RosPath path_;
  dds::Writer odometry_;
  std::optional<dds::Writer> predicted_, tf_, frames_, path_writer_, features_;
  std::unique_ptr<FeatureImages> feature_images_;  ///< with these
  dds::Writer diagnostics_;
  RateHistory rates_;
  std::mutex mutex_;  ///< of the health
  Health health_;
};

}  // namespace ear::live
