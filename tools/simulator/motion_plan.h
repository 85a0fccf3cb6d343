// From a table of legs to a smooth motion: driving (contact, rolling, a body that pitches freely), flying, landing.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "ear/calibration.h"
#include "tools/simulator/random.h"
#include "tools/simulator/sequence.h"
#include "tools/simulator/trajectory.h"

namespace ear::simulator {

enum class Mode : std::uint8_t { ground, air };

struct MotionPlan {
  Trajectory trajectory;
  std::vector<Mode> mode;  ///< one per period of the trajectory; a landing is `air` until the bounce has died away
  std::vector<double> touchdowns;  ///< when wheels strike the ground [s]
  /// Speed of the rims beyond that of rolling, left and right [m/s], one per period; empty if the wheels never slip.
  std::vector<std::array<double, 2>> slip = {};
};

/// How hard the wheels strike at touchdowns within a time: tyres as stiff as gives this peak.
struct HardLanding {
  double begin = 0.0, end = 0.0;  ///< [s]
  double peak = 0.0;              ///< of the specific force in units of gravity, before any sensor averages it
};

/// Plans the sequence for a vehicle with this axle. `rng` draws the phases of swings and gusts. A hard landing changes
/// the motion for 0.15 s (up to 0.2 s where it makes it softer) after the touchdown, and nothing else.
[[nodiscard]] MotionPlan plan_motion(const Sequence& sequence, const EncoderCalibration& axle, Rng& rng,
                                     const std::vector<HardLanding>& hard_landings = {});

}  // namespace ear::simulator
