// Do IMU, odometer and camera agree about how far the body went between two frames? If not, who is at fault, and how
// much is it to count? The paper's III-D, (13)-(15); docs/anomaly.md.
#pragma once

#include "ear/estimate.h"
#include "ear/filter_config.h"
#include "ear/health.h"
#include "filter/advice.h"
#include "filter/ekf/displacement.h"
#include "filter/ekf/gate.h"

namespace ear {

class ConsistencyCheck {
 public:
  explicit ConsistencyCheck(const AnomalyConfig& config);

  /// Weights are 1 except for the sensor at fault, and 0 where there is no displacement. It takes three to show who is
  /// at fault; two that disagree keep their weights. A sensor that contradicts itself is at fault in any case.
  [[nodiscard]] Consistency operator()(const Displacements& displacements) const;

 private:
  AnomalyConfig config_;
  Gate gate_;
};

/// Weights (15), where they are switched on: of the sensor at fault; and whether the left camera is sound.
[[nodiscard]] Advice advise(const Consistency& consistency, const Health& health, const AnomalyConfig& config);

}  // namespace ear
