// What drives that a test makes by hand, from formulas, have in common.
#pragma once

#include <Eigen/Core>
#include <cmath>

#include "ear/calibration.h"
#include "ear/types.h"
#include "filter/ekf/so3.h"

namespace ear::test {

/// Of a moment `t` [s] after the beginning.
inline TimeNs stamp(double t) { return 1'000'000'000 + static_cast<TimeNs>(std::llround(1e9 * t)); }

/// Two wheels of `radius` [m], `track_width` [m] apart; neither camera nor lasers.
inline Calibration two_wheels(double radius, double track_width) {
  Calibration calibration;
  EncoderCalibration& axle = calibration.encoder.emplace();
  axle.wraps = false;
  axle.wheel_radius = {radius, radius};
  axle.track_width = track_width;
  return calibration;
}

/// Of a body whose attitude at `t` is `R_WB(t)`, in the body [rad/s].
template <typename Attitude>
Eigen::Vector3d rate_of(const Attitude& R_WB, double t) {
  constexpr double h = 1e-4;
  return log_so3(R_WB(t - h).transpose() * R_WB(t + h)) / (2.0 * h);
}

}  // namespace ear::test
