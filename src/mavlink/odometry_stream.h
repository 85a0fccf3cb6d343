// What to send to the flight controller, and when: ODOMETRY at 30 to 50 Hz while the estimate can be used, nothing
// while it cannot, and a line of text when that changes. It sends nothing itself and has no clock: time comes with the
// data.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <optional>

#include "ear/calibration.h"
#include "ear/estimate.h"
#include "ear/health.h"
#include "src/mavlink/messages.h"
#include "src/mavlink/odometry_message.h"
#include "src/rate_history.h"

namespace ear::mavlink {

/// What the pilot reads.
enum class LinkHealth : std::uint8_t {
  starting,  ///< no estimate yet
  good,
  weak,  ///< a sensor is faulty, or little is seen: the estimate drifts sooner
  lost   ///< there was an estimate, and there is none, or inertia alone carries it on
};

/// `faulty`: the sources that a weak estimate does without.
[[nodiscard]] StatusText to_text(LinkHealth health, const SourceSet& faulty);
[[nodiscard]] SystemState to_system_state(LinkHealth health);

class OdometryStream {
 public:
  /// R_BV: vehicle (x forward, y right, z down) to body; see mounting_of().
  OdometryStream(const Eigen::Matrix3d& R_BV, const ImuCalibration& imu);

  /// Every inertial sample, in time order: the angular rate comes from these.
  void add_imu(const ImuSample& sample) { rates_.add(sample); }

  /// The outcome of one frame or step. The message to send, if any.
  [[nodiscard]] std::optional<OdometryMessage> add_frame(const std::optional<Estimate>& estimate, Status status);

  /// Where frames come at less than 30 Hz, predicted states fill the gaps: is one due at `t_ns`?
  [[nodiscard]] bool wants_prediction(TimeNs t_ns) const;
  [[nodiscard]] OdometryMessage add_prediction(const NavState& state);

  [[nodiscard]] LinkHealth health() const { return health_; }

 private:
  [[nodiscard]] LinkHealth health_after(const std::optional<Estimate>& estimate, Status status) const;
  [[nodiscard]] OdometryMessage make_message(const NavState& state);

  Eigen::Matrix3d R_BV_;
  double rate_variance_;  ///< of one gyroscope sample [rad^2/s^2]
  RateHistory rates_;
  LinkHealth health_ = LinkHealth::starting;
  std::uint8_t reset_counter_ = 0;

  std::optional<Estimate> last_;          ///< the last estimate
  std::optional<double> frame_interval_;  ///< [s] between the last two estimates
  TimeNs last_supported_ns_ = 0;
  TimeNs last_sent_ns_ = 0;
};

}  // namespace ear::mavlink
