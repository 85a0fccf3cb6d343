// The noise of an inertial sensor from a recording of it at rest: Allan deviation (IEEE Std 952), white noise and
// random walk, each with its uncertainty.
#pragma once

#include <Eigen/Core>
#include <array>
#include <optional>
#include <vector>

#include "ear/types.h"

namespace ear::calibration {

/// Overlapping Allan deviation at one averaging time.
struct AllanPoint {
  double tau = 0.0;             ///< [s]
  double deviation = 0.0;       ///< [unit of the signal]
  double relative_sigma = 0.0;  ///< of the deviation: 1 / sqrt(2 degrees of freedom)
};

/// A value that was found, and its standard deviation.
struct Measured {
  double value = 0.0;
  double sigma = 0.0;
};

struct AllanResult {
  std::vector<AllanPoint> points;
  std::optional<Measured> white;        ///< density [unit/sqrt(Hz)]
  std::optional<Measured> random_walk;  ///< density [unit/s/sqrt(Hz)]; nothing where the length cannot tell
  double walk_below = 0.0;              ///< where it cannot: what it is below, with 97.5 % probability
};

/// Of one axis, evenly sampled at `interval` seconds.
[[nodiscard]] AllanResult allan(const std::vector<double>& signal, double interval);

/// Of all six axes: gyroscope x, y, z [rad/s], accelerometer x, y, z [m/s^2]. Only the longest stretch at rest is used.
struct ImuNoise {
  double duration = 0.0;  ///< [s] of that stretch
  double rate_hz = 0.0;
  std::vector<AllanResult> axes;
  /// What the samples jitter by from one 10 ms to the next, as a density [unit/sqrt(Hz)]: no motion is as fast.
  std::array<double, 6> jitter{};
};

/// Throws std::invalid_argument where it does not stand for 2 s at least.
[[nodiscard]] ImuNoise noise_at_rest(const std::vector<ImuSample>& imu);

/// How many times as much each axis jitters in motion as at rest: what rotors and wheels add.
struct MotionNoise {
  double duration = 0.0;  ///< [s] in motion
  std::array<Measured, 6> times;
};

/// By the half seconds in which the body turns or shakes; the median of them, so that strikes do not count. Throws
/// std::invalid_argument where there are not 3 s of motion, or where the samples come at another rate than at rest.
[[nodiscard]] MotionNoise noise_in_motion(const ImuNoise& rest, const std::vector<ImuSample>& imu);

}  // namespace ear::calibration
