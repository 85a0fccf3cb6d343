// The wheels' angles relative to the body, as the encoders read them: rolling on the ground, coasting in the air.
#pragma once

#include <array>
#include <vector>

#include "ear/calibration.h"
#include "tools/simulator/motion_plan.h"
#include "tools/simulator/terrain.h"

namespace ear::simulator {

/// Rates at which wheels that roll without slip turn relative to the body [rad/s], left and right, forward positive.
[[nodiscard]] std::array<double, 2> rolling_rates(const Kinematics& motion, const Terrain& terrain,
                                                  const EncoderCalibration& axle);

class WheelMotion {
 public:
  /// Integrates the rates over the whole plan. Wheels in the air lose their speed with a time constant of 2 s, and are
  /// spun up again within some 60 ms after the touchdown.
  /// On the ground they slip as the plan says.
  WheelMotion(const MotionPlan& plan, const Terrain& terrain, const EncoderCalibration& axle);

  /// Angles relative to the body [rad], left and right, zero at the start.
  [[nodiscard]] std::array<double, 2> angles(double t) const;
  /// Speed of the wheels' rims over the ground, mean of both [m/s]: zero while they roll. In the air it is zero, too.
  [[nodiscard]] double slip(double t) const;

 private:
  struct Knot {
    std::array<double, 2> angle{}, rate{};
    double slip = 0.0;
  };
  double period_;
  std::vector<Knot> knots_;
};

}  // namespace ear::simulator
