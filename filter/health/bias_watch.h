// Did the bias of the gyroscope or of the accelerometer jump? Sound biases walk slowly, and each update corrects them
// about as much as it lowers their variance. Corrections that add up to more than these variances allow show a bias
// that is elsewhere. docs/filter.md, "Gaps and jumps".
#pragma once

#include "ear/types.h"
#include "filter/ekf/records.h"
#include "filter/ingest/imu_spike.h"

namespace ear {

class BiasWatch {
 public:
  /// What all updates since the last call did, the state now being at `t_ns`, with an image (`image`) or without: then
  /// it takes more, for wheels that slip for long look like a bias that jumped. What speaks for a jump is forgotten
  /// when it was reported. Updates by images count sooner: wheels that leave the ground unnoticed mislead.
  ImuFault judge(const BiasChanges& changes, TimeNs t_ns, bool image);

 private:
  BiasChange all_, by_images_;
  TimeNs judged_ns_ = 0;
};

}  // namespace ear
