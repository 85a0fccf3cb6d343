// How exact are the features of a frame? What both cameras see must lie on a line, wherever the point and the vehicle
// are: how far it does not is noise. In poor light it is more than usual. docs/filter.md, "Poor light".
#pragma once

#include <vector>

#include "ear/types.h"
#include "filter/ekf/state.h"

namespace ear {

class ImageNoise {
 public:
  ImageNoise();

  /// Standard deviation of one observation, one axis, by the distances from the epipolar lines [normalized]; what is
  /// common to all of them is an error of the calibration, and left out. 0 with fewer than 20 stereo features.
  [[nodiscard]] double measure(const FeatureFrame& frame, const CameraState& cameras);

 private:
  std::vector<double> distances_;
};

}  // namespace ear
