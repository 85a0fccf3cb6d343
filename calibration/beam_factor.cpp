#include "calibration/models.h"

namespace ear::calibration {

template class JetFactor<BeamModel, 1, 7, 9, 3, 5, 1>;

}  // namespace ear::calibration
