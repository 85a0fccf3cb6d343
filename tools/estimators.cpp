#include "tools/estimators.h"

#include <stdexcept>

#include "filter/filter.h"
#ifdef EAR_WITH_SMOOTHER
#include "smoother/smoother.h"
#endif

namespace ear::tools {

std::vector<std::string> estimator_names() {
#ifdef EAR_WITH_SMOOTHER
  return {"filter", "smoother"};
#else
  return {"filter"};
#endif
}

MakeEstimator estimator_named(const std::string& name) {
  if (name == "filter") {
    return [](const FilterConfig& config, const Calibration& calibration) {
      return std::make_unique<Filter>(config, calibration);
    };
  }
#ifdef EAR_WITH_SMOOTHER
  if (name == "smoother") {
    return [](const FilterConfig& config, const Calibration& calibration) {
      return std::make_unique<smoother::Smoother>(config, calibration);
    };
  }
#endif
  throw std::invalid_argument("estimator: " + name + " is not built");
}

}  // namespace ear::tools
