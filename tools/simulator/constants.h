#pragma once

namespace ear::simulator {

inline constexpr double kPi = 3.14159265358979323846;
inline constexpr double kDegree = kPi / 180.0;  // [rad]
inline constexpr double kGravity = 9.81;        // [m/s^2]
inline constexpr double kCoasting = 2.0;        // [s] in which a lifted wheel loses its speed

}  // namespace ear::simulator
