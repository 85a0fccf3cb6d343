// Two displacements of the wheels in a row as one.
#pragma once

#include "smoother/wheel_preintegration.h"

namespace ear::smoother {

/// `first` from i to j, `second` from j to k: from i to k, with the bias and the wheels of the first, to first order.
/// The normals of both count as measured: there is no derivative by that at the start.
[[nodiscard]] WheelDisplacement chained(const WheelDisplacement& first, const WheelDisplacement& second);

}  // namespace ear::smoother
