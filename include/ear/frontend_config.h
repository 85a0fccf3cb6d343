// Settings of the front end. Each default is one value for all recordings; docs/frontend.md has the measurements.
#pragma once

#include "ear/kernels.h"

namespace ear {

struct FrontendConfig {
  int max_features = 150;           ///< tracks kept at a time
  double nearest_depth = 0.15;      ///< [m] closer points are not searched for across the stereo pair
  bool motion_prediction = true;    ///< search features where the state's motion predicts them; else where they were
  Kernels kernels = Kernels::best;  ///< another choice is for tests and comparisons; not in files
};

}  // namespace ear
