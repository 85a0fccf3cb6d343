// How far the body went from one frame to the next, as one sensor measures it: what (13)-(15) compare.
#pragma once

#include <Eigen/Core>
#include <array>

#include "ear/estimate.h"

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

}  // namespace ear
