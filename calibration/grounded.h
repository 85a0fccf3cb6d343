// Where the wheels carry the vehicle, by what nobody needs to have calibrated: how much longer the beams are than
// usual.
#pragma once

#include "calibration/segment.h"

namespace ear::calibration {

/// Marks each keyframe. Off the ground is where the mean of all beams is 6 cm longer than where the vehicle stands, or
/// most beams have no return, and a second around it. A vehicle without beams is always on the ground. For 30 % of
/// the drive, at least, it must be on the ground.
void mark_ground(Segment& segment, const LaserCalibration& lasers);

/// A first guess of the ground under each keyframe: the plane that the odometer stands on, and in the air the last one.
void guess_ground(Segment& segment, const OdometerState& odometer);

}  // namespace ear::calibration
