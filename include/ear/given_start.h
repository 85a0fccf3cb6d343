// A start that is given: where the vehicle is at some time, by whatever knows it besides the estimator's sensors.
#pragma once

#include <optional>

#include "ear/estimate.h"

namespace ear {

/// The state at one time, and standard deviations of what is known of it. The estimates are then in the world of this
/// state. Zero is by definition: that world's origin and yaw are where this state says.
struct GivenStart {
  NavState state;                          ///< t_ns in IMU time; biases are zero unless they are known
  double tilt_sigma = 0.02;                ///< [rad] of roll and pitch, each
  double yaw_sigma = 0.0;                  ///< [rad]; may be zero
  double position_sigma = 0.0;             ///< [m] each axis; may be zero
  double velocity_sigma = 0.1;             ///< [m/s] each axis
  std::optional<double> gyro_bias_sigma;   ///< [rad/s] each axis; empty: as for any other start
  std::optional<double> accel_bias_sigma;  ///< [m/s^2] each axis; empty: as for any other start
};

/// The same with a rotation of length one, if it is usable. Throws std::invalid_argument, naming the field, for values
/// that are not finite, a rotation whose length is off by more than 1e-3, and standard deviations that are negative, or
/// zero where none may be.
[[nodiscard]] GivenStart checked(const GivenStart& start);

}  // namespace ear
