// Writes what ros_output.h makes of estimates to the wire.
#pragma once

#include <memory>
#include <mutex>
#include <optional>
#include <string>

#include "src/dds/participant.h"
#include "src/live/ros_output.h"

namespace ear::live {

class RosPublisher {
 public:
  /// `participant` must outlive it. Throws std::runtime_error.
  RosPublisher(const dds::Participant& participant, RosMessages messages);

  /// By the inertial sensor's thread, after each sample.
  void take(const ImuSample& sample, const std::optional<NavState>& state);
  /// By the estimator's thread: also the newest sample's rate.
  void take(const LiveSample& sample) { gyro_B_ = sample.imu.gyro_B; }
  void take(const LiveFrame& frame);
  /// By the main thread, once a second.
  void tell(TimeNs t_ns, const std::string& rates);

 private:
  RosMessages messages_;
  RosPath path_;
  dds::Writer odometry_;
  std::optional<dds::Writer> predicted_, tf_, path_writer_;
  dds::Writer diagnostics_;
  Eigen::Vector3d gyro_B_ = Eigen::Vector3d::Zero();
  std::mutex mutex_;  ///< of the health
  Health health_;
};

}  // namespace ear::live
