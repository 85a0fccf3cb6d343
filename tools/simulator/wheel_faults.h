// Wheels that do not roll as they should: how far faults turn them beyond the clean motion.
#pragma once

#include <array>
#include <vector>

#include "ear/calibration.h"
#include "tools/simulator/faults.h"
#include "tools/simulator/motion_plan.h"
#include "tools/simulator/wheel_motion.h"

namespace ear::simulator {

/// The part of wheel_slipping, wheel_idle_spin and wheel_lifted. Each comes and goes within 0.1 s, inside its interval;
/// the angle that it has added by then stays.
class WheelFaults {
 public:
  /// `plan` and `wheels` are of the clean motion.
  WheelFaults(const std::vector<Fault>& faults, const MotionPlan& plan, const WheelMotion& wheels,
              const EncoderCalibration& axle);

  /// Angles beyond those of the clean motion [rad], left and right, forward positive.
  [[nodiscard]] std::array<double, 2> angles(double t) const;
  /// What the faults add to the speed of the rims over the ground, mean of both wheels [m/s]; 0 for a wheel off it.
  [[nodiscard]] double slip(double t) const;

 private:
  struct Knot {
    std::array<double, 2> angle{};
    double slip = 0.0;
  };
  struct Excess {
    Fault fault;
    double period = 0.0;  // [s] from knot to knot, the first at the fault's start, the last at its end
    std::vector<Knot> knots;
  };
  std::vector<Excess> excesses_;
};

}  // namespace ear::simulator
