#include "calibration/models.h"

namespace ear::calibration {

template class JetFactor<ReferenceModel, 3, 7, 9, 4>;

}  // namespace ear::calibration
