// One inertial sample that is far from both its neighbours, which agree with each other, is a fault of the sensor or of
// its bus: no strike lasts for one sample only.
#pragma once

#include "ear/types.h"

namespace ear {

/// Which of the inertial sensors is at fault?
struct ImuFault {
  bool gyro = false;
  bool accel = false;
  [[nodiscard]] bool any() const { return gyro || accel; }
};

/// Is `suspect` one, between its neighbours?
[[nodiscard]] ImuFault find_spike(const ImuSample& before, const ImuSample& suspect, const ImuSample& after);

}  // namespace ear
