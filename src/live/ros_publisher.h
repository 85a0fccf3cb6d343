// Writes what ros_output.h makes of estimates to the wire.
#pragma once

#include <cstdint>
#include <functional>
#include <mutex>
#include <optional>
#include <string>
#include <vector>

#include "src/dds/participant.h"
#include "src/live/ros_output.h"

namespace ear::live {

class RosPublisher {
 public:
  /// `participant` must outlive it. Throws std::runtime_error.
  /// `on_message` is told of what the estimator's thread sends, if it is there: topic, type, stamp, CDR.
  using OnMessage =
      std::function<void(const std::string&, const std::string&, TimeNs, const std::vector<std::uint8_t>&)>;
  RosPublisher(const dds::Participant& participant, RosMessages messages, OnMessage on_message);

  /// By the inertial sensor's thread, after each sample.
  void take(const ImuSample& sample, const std::optional<NavState>& state);
  /// By the estimator's thread: also the newest sample's rate.
  void take(const LiveSample& sample) { gyro_B_ = sample.imu.gyro_B; }
  void take(const LiveFrame& frame);
  /// By the main thread, once a second.
  void tell(TimeNs t_ns, const std::string& rates);

 private:
  template <typename Message>
  void write(dds::Writer& writer, const std::string& topic, TimeNs t_ns, const Message& message);

  RosMessages messages_;
  OnMessage on_message_;
  RosPath path_;
  dds::Writer odometry_;
  std::optional<dds::Writer> predicted_, tf_, path_writer_;
  dds::Writer diagnostics_;
  Eigen::Vector3d gyro_B_ = Eigen::Vector3d::Zero();
  std::mutex mutex_;  ///< of the health
  Health health_;
};

}  // namespace ear::live
