// How much the estimator may cost. docs/performance.md, section "A budget".
#pragma once

namespace ear {

struct PerformanceConfig {
  double budget_ms = 0.0;  ///< [ms] that a frame may cost in the mean; 0: as much as it takes
};

}  // namespace ear
