#include "filter/health/advise.h"

#include <algorithm>

namespace ear {

Advice advise(const Consistency& consistency, const Health& health, const AnomalyConfig& config) {
  Advice advice;
  advice.cameras_sound = !health.faulty[index_of(Source::camera_left)];
  if (config.enabled && consistency.anomalous) {
    const std::size_t sensor = index_of(*consistency.anomalous);
    advice.weight[sensor] = std::max(consistency.weight[sensor], config.min_weight);
  }
  return advice;
}

}  // namespace ear
