#include "calibration/models.h"

namespace ear::calibration {

template class JetFactor<RollModel, 3, 7, 7, 9, 3, 5, 1>;

}  // namespace ear::calibration
