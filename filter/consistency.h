// Do IMU, odometer and camera agree about how far the body went between two frames? If not, who is at fault, and how
// much is it to be trusted? The paper's III-D, (13)-(15); docs/anomaly.md.
#pragma once

#include <Eigen/Core>
#include <array>

#include "ear/estimate.h"
#include "ear/filter_config.h"
#include "filter/chi_squared.h"

namespace ear {

/// How far the body went from frame i to frame j, as one sensor sees it.
struct Displacement {
  bool available = false;
  bool contradictory = false;  ///< not available, because what the sensor measured contradicts itself
  Eigen::Vector3d p_BiBj = Eigen::Vector3d::Zero();      ///< [m]
  Eigen::Matrix3d covariance = Eigen::Matrix3d::Zero();  ///< of p_BiBj [m^2], positive definite
};

/// In the order of MotionSensor.
using Displacements = std::array<Displacement, kMotionSensors>;

[[nodiscard]] constexpr std::size_t index_of(MotionSensor sensor) { return static_cast<std::size_t>(sensor); }

class ConsistencyCheck {
 public:
  explicit ConsistencyCheck(const AnomalyConfig& config);

  /// Weights are 1 except for the sensor at fault, and 0 where there is no displacement. It takes three to tell who is
  /// at fault; two that disagree keep their weights. A sensor that contradicts itself is at fault in any case.
  [[nodiscard]] Consistency operator()(const Displacements& displacements) const;

 private:
  AnomalyConfig config_;
  ChiSquaredGate gate_;
};

}  // namespace ear
