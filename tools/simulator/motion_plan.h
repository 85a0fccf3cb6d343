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

/// Plans the sequence for a vehicle with this axle. `rng` draws the phases of swings and gusts.
[[nodiscard]] MotionPlan plan_motion(const Sequence& sequence, const EncoderCalibration& axle, Rng& rng);

}  // namespace ear::simulator
