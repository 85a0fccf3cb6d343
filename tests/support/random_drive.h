// What wheels and gyroscope read on a drive, for tests of the pre-integration.
#pragma once

#include <Eigen/Core>
#include <random>
#include <vector>

#include "smoother/wheel_preintegration.h"
#include "tests/support/random_state.h"

namespace ear::test {

/// Readings over one interval.
struct WheelInterval {
  Eigen::Vector3d gyro_B;  ///< mean rate [rad/s]
  double dt = 0.01;        ///< [s]
  Eigen::Vector2d turn;    ///< of the wheels relative to the body, left and right [rad]
};

/// Forward at 1 m/s, with uneven steps in which the wheels turn unevenly and the body turns about all axes.
inline std::vector<WheelInterval> random_drive(std::mt19937_64& rng, int count) {
  std::uniform_real_distribution<double> time(0.005, 0.02);
  std::vector<WheelInterval> intervals;
  for (int i = 0; i < count; ++i) {
    WheelInterval interval;
    interval.gyro_B = random_vector(rng, 0.4);
    interval.dt = time(rng);
    const Eigen::Vector3d wheel_rate = random_vector(rng, 1.5) + Eigen::Vector3d::Constant(12.0);
    interval.turn = wheel_rate.head<2>() * interval.dt;
    intervals.push_back(interval);
  }
  return intervals;
}

/// A normal that comes in on the way.
struct NormalSighting {
  std::size_t before = 0;  ///< number of the interval that it comes before
  Eigen::Vector3d n_Bk;
  double sigma = 0.0;  ///< [rad]
};

inline smoother::WheelDisplacement preintegrate(const std::vector<WheelInterval>& intervals,
                                                const smoother::WheelModel& wheels, const smoother::WheelNoise& noise,
                                                const Eigen::Vector3d& n_Bi, const Eigen::Vector3d& b_g,
                                                const NormalSighting* sighting = nullptr) {
  smoother::WheelPreintegration integration(wheels, noise);
  integration.start(n_Bi, b_g);
  for (std::size_t i = 0; i < intervals.size(); ++i) {
    if (sighting != nullptr && sighting->before == i) integration.set_normal(sighting->n_Bk, sighting->sigma);
    integration.add_interval(intervals[i].gyro_B, intervals[i].dt, intervals[i].turn);
  }
  return integration.result();
}

}  // namespace ear::test
