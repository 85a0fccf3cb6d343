// Did the bias of the gyroscope or of the accelerometer jump? Sound biases walk slowly, and each update corrects them
// about as much as it lowers their variance. Corrections that add up to more than these variances allow show a bias
// that is elsewhere, and how far: as far as would have made such corrections. docs/filter.md, "Gaps and jumps".
#pragma once

#include <optional>

#include "ear/types.h"
#include "filter/ekf/records.h"
#include "filter/ingest/imu_spike.h"

namespace ear {

struct BiasJump {
  /// What the biases seem to be off by since, root mean square: gyroscope [rad/s], accelerometer [m/s^2]; 0: nothing
  /// jumped.
  BiasChanges::Vector6 size = BiasChanges::Vector6::Zero();
  /// Since a jump the biases moved by more than those of sound sensors change. Less only shows that the updates'
  /// innovations are not white: the same scene, the same slip, the same wrong calibration.
  ImuFault fault;
};

class BiasWatch {
 public:
  /// What all updates since the last call did, the state now being at `t_ns`. What speaks for a jump is forgotten when
  /// it was found, and with time.
  BiasJump judge(const BiasChanges& changes, TimeNs t_ns);

 private:
  BiasChanges sum_;
  BiasChanges::Vector6 moved_ = BiasChanges::Vector6::Zero();  ///< of late
  BiasChanges::Vector6 known_ = BiasChanges::Vector6::Zero();  ///< to so much before the last jump
  std::optional<TimeNs> judged_ns_, jumped_ns_;
};

}  // namespace ear
