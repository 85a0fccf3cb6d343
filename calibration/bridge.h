// Gaps in the first guess of a vehicle without cameras: nothing but the inertial samples tells how it moves in the air.
#pragma once

#include <vector>

#include "calibration/first_guess.h"

namespace ear::calibration {

/// States over the gaps that are longer than `gap` and shorter than `longest` [s], `interval` apart. `states` begin
/// anew after a gap, at rest on the ground, in a world of their own: they are moved to where the inertial samples lead,
/// at the height at which the vehicle was before. What those samples then miss is spread over the gap. The last second
/// before a gap is not believed: an estimate that is lost was wrong before.
[[nodiscard]] std::vector<GuessedState> bridge_gaps(const std::vector<GuessedState>& states,
                                                    const std::vector<ImuSample>& imu, double interval, double gap,
                                                    double longest);

}  // namespace ear::calibration
