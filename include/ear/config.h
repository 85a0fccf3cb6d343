// All settings of the estimator. The defaults run every recording; a configuration file changes single fields.
#pragma once

#include "ear/filter_config.h"
#include "ear/frontend_config.h"
#include "ear/performance_config.h"

namespace ear {

struct Config {
  FrontendConfig frontend;
  FilterConfig filter;
  PerformanceConfig performance;
};

}  // namespace ear
