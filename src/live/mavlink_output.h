// What a live process tells a flight controller: as `ear run --mavlink` (docs/mavlink.md).
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <string>

#include "src/live/live_estimator.h"
#include "src/log/repeat_limit.h"
#include "src/mavlink/link.h"
#include "src/mavlink/odometry_stream.h"

namespace ear::live {

/// By the estimator's thread alone. Sending waits for nobody.
class MavlinkOutput {
 public:
  /// R_BV: see mavlink::mounting_of(). `link` must outlive it.
  MavlinkOutput(mavlink::Link& link, const Eigen::Matrix3d& R_BV, const ImuCalibration& imu);

  void take(const LiveSample& sample);
  void take(const LiveFrame& frame);

 private:
  void announce(mavlink::LinkHealth health, const SourceSet& faulty);

  mavlink::Link& link_;
  mavlink::OdometryStream stream_;
  std::string announced_;
  std::uint64_t dropped_ = 0;  ///< messages not taken that the log knows of
  RepeatLimit log_limit_{10.0};
};

}  // namespace ear::live
