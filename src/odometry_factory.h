// class Odometry with another estimator in place of the filter: for comparisons.
#pragma once

#include <functional>
#include <memory>

#include "ear/odometry.h"
#include "filter/estimator.h"

namespace ear {

using MakeEstimator = std::function<std::unique_ptr<Estimator>(const FilterConfig&, const Calibration&)>;

class OdometryFactory {
 public:
  /// Throws as the constructors of Odometry and of the estimator do.
  [[nodiscard]] static Odometry make(const Config& config, const Calibration& calibration, MakeEstimator make,
                                     Clock clock = {});
};

}  // namespace ear
