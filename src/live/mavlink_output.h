// What a flight controller is told, by a live process and by `ear run --mavlink` (docs/mavlink.md): estimates,
// predicted states between them, and a line of text when the health of the estimate changes.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <string>

#include "src/live/live_estimator.h"
#include "src/log/repeat_limit.h"
#include "src/mavlink/link.h"
#include "src/mavlink/odometry_stream.h"

namespace ear::live {

/// By one thread alone, the estimator's. Sending waits for nobody.
class MavlinkOutput {
 public:
  /// R_BV: see mavlink::mounting_of(). `link` must outlive it.
  MavlinkOutput(mavlink::Link& link, const Eigen::Matrix3d& R_BV, const ImuCalibration& imu);

  void take(const LiveSample& sample);
  void take(const LiveFrame& frame);

  /// take(LiveSample) in its two steps, for who must not predict a state unless it is due.
  void add_imu(const ImuSample& sample) { stream_.add_imu(sample); }
  [[nodiscard]] bool wants_prediction(TimeNs t_ns) const { return stream_.wants_prediction(t_ns); }
  void send_prediction(const NavState& state) { link_.send(stream_.add_prediction(state)); }

 private:
  void announce(mavlink::LinkHealth health, const SourceSet& faulty);

  mavlink::Link& link_;
  mavlink::OdometryStream stream_;
  std::string announced_;
  std::uint64_t dropped_ = 0;  ///< messages not taken that the log knows of
  RepeatLimit log_limit_{10.0};
};

}  // namespace ear::live
