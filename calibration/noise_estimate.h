// How exact the sensors are, by what a drive shows.
#pragma once

#include <vector>

#include "calibration/roll.h"
#include "calibration/segment.h"

namespace ear::calibration {

/// Standard deviation of values about zero by their median size, which a few wild ones do not change. 0 for none.
[[nodiscard]] double robust_sigma(std::vector<double> values);

/// How much the wheels slip [m/sqrt(m)]: the difference of both wheels' paths against the gyroscope, beyond what
/// encoders and gyroscope explain. Nothing where the wheels hardly turned.
[[nodiscard]] std::optional<double> slip_of(const Segment& segment, const RollSetting& setting);

}  // namespace ear::calibration
