// Which flows fit one essential matrix: all that can be said where neither rotation nor depths are known.
#pragma once

#include <cstdint>
#include <vector>

#include "frontend/flow_check.h"

namespace ear {

/// A flag for each flow: 1 if it fits within `tolerance` of normalized coordinates. A static or purely turning camera
/// fits as well. `confidence`: of the sample consensus.
[[nodiscard]] std::vector<std::uint8_t> essential_inliers(const std::vector<Flow>& flows, double tolerance,
                                                          double confidence);

}  // namespace ear
