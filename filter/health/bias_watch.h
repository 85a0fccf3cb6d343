// Did the bias of the gyroscope or of the accelerometer jump? Sound biases walk slowly, and each update corrects them
// about as much as it lowers their variance. Corrections that add up to more than these variances allow show a bias
// that is elsewhere: by as much as was observed, no more. docs/filter.md, "Gaps and jumps".
#pragma once

#include <optional>

#include "ear/types.h"
#include "filter/ekf/records.h"
#include "filter/ingest/imu_spike.h"

namespace ear {

/// By how much the biases seem to have jumped: gyroscope [rad/s], accelerometer [m/s^2]; the axis with most of it, 0 if
/// none did.
struct BiasJump {
  double gyro = 0.0;
  double accel = 0.0;
  /// Over the last moments it was more than the bias of a sound sensor changes by. Less only shows that the updates'
  /// innovations are not white: the same scene, the same slip, the same wrong calibration.
  ImuFault fault;

  [[nodiscard]] bool any() const { return gyro > 0.0 || accel > 0.0; }
};

class BiasWatch {
 public:
  /// What all updates since the last call did, the state now being at `t_ns`. What speaks for a jump is forgotten when
  /// it was found, and after the first call.
  BiasJump judge(const BiasChanges& changes, TimeNs t_ns);

 private:
  BiasChanges sum_;                                            ///< since the last jump
  BiasChanges::Vector6 moved_ = BiasChanges::Vector6::Zero();  ///< by jumps and all, of late
  std::optional<TimeNs> judged_ns_;
};

}  // namespace ear
