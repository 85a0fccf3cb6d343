// By how much a sensor's stamps are off those of the inertial samples, against what is usual.
#pragma once

#include "ear/types.h"

namespace ear {

class StampWatch {
 public:
  /// A stamp, and that of the newest inertial sample. Is the difference an unusual one?
  bool add(TimeNs stamp_ns, TimeNs imu_ns);

 private:
  TimeNs last_imu_ns_ = 0;
  int count_ = 0;
  double usual_ = 0.0;     ///< [s]
  double variance_ = 0.0;  ///< [s^2] of the distance from it
};

}  // namespace ear
