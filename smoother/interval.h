// What happened between two frames of the window, as terms of (1) take it.
#pragma once

#include <Eigen/Core>
#include <optional>

#include "ear/types.h"
#include "smoother/imu_preintegration.h"
#include "smoother/wheel_preintegration.h"

namespace ear::smoother {

/// From one frame to the next.
struct Interval {
  ImuPreintegration imu{Eigen::Vector3d::Zero(), Eigen::Vector3d::Zero()};
  std::optional<WheelDisplacement> wheels;  ///< where they show something
  bool still = false;                       ///< the vehicle stood all the time
};

/// A frame as it comes in.
struct NewFrame {
  TimeNs t_ns = 0;                                   ///< IMU time, by the time offset of now
  Interval since;                                    ///< the frame before
  Eigen::Vector3d rate_B = Eigen::Vector3d::Zero();  ///< [rad/s] at its time, bias removed
  double feature_noise = 1.0;                        ///< standard deviation of its features, times the usual
};

}  // namespace ear::smoother
