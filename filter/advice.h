// How the sensors are to be used over the interval at hand. This is where the scores of all sensors come in.
#pragma once

#include <array>

#include "ear/estimate.h"
#include "filter/ekf/displacement.h"

namespace ear {

struct Advice {
  std::array<double, kMotionSensors> weight{1.0, 1.0, 1.0};  ///< (15), in the order of MotionSensor
  bool cameras_sound = true;                                 ///< their calibration may be learned

  [[nodiscard]] double of(MotionSensor sensor) const { return weight[index_of(sensor)]; }
};

}  // namespace ear
