// What the health monitor and the comparison of the sensors advise: how much each sensor is to count.
#pragma once

#include "ear/filter_config.h"
#include "ear/health.h"
#include "filter/advice.h"

namespace ear {

/// Weights (15), where they are switched on: of the sensor at fault; and whether the left camera is sound.
[[nodiscard]] Advice advise(const Consistency& consistency, const Health& health, const AnomalyConfig& config);

}  // namespace ear
