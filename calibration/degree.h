// The unit that people state angles in.
#pragma once

namespace ear::calibration {

inline constexpr double kDegree = 3.14159265358979323846 / 180.0;  ///< [rad]

}  // namespace ear::calibration
