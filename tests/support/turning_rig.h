// A body that sways about all axes, and two frames of its cameras after the other: what they show beyond the gyroscope.
#pragma once

#include <Eigen/Core>
#include <random>

#include "filter/sources/seen_turn.h"

namespace ear {

/// A body that sways about all axes, and cameras that see it turn.
struct TurningRig {
  static constexpr double kSigma = 0.02;           ///< [rad/s] of a turn by two images
  double late = 0.0;                               ///< [s] the images are taken after their stamps
  double dt = 1.0 / 30.0;                          ///< [s] from frame to frame
  double noise = 1.0;                              ///< times what is stated
  Eigen::Vector3d bias = Eigen::Vector3d::Zero();  ///< [rad/s] of the gyroscope
  Eigen::Matrix3d axes = Eigen::Matrix3d::Zero();  ///< what is measured of the rate besides itself
  double size = 0.3;                               ///< [rad/s]

  explicit TurningRig(unsigned seed) : rng_(seed) {
    std::uniform_real_distribution<double> phase(0.0, 6.28);
    for (int i = 0; i < 3; ++i) phase_(i) = phase(rng_);
  }

  /// [rad]: its derivative sways with 0.3 to 1.1 Hz.
  [[nodiscard]] Eigen::Vector3d angle(double t) const {
    const Eigen::Array3d frequency(1.9, 4.3, 7.0);  // [rad/s]
    return (size / frequency * (frequency * t + phase_).sin()).matrix();
  }

  SeenTurn next() {
    std::normal_distribution<double> normal(0.0, noise * kSigma);
    const double t = dt * ++steps_;
    const auto rate = [&](double at) { return Eigen::Vector3d((angle(at) - angle(at - dt)) / dt); };
    SeenTurn turn;
    turn.t_ns = static_cast<TimeNs>(1e9 * t);
    turn.duration = dt;
    turn.rate_B = rate(t) + axes * rate(t) + bias;
    turn.beyond_B = rate(t + late) - turn.rate_B + Eigen::Vector3d::NullaryExpr([&] { return normal(rng_); });
    turn.variance = kSigma * kSigma;
    return turn;
  }

 private:
  std::mt19937_64 rng_;
  int steps_ = 0;
  Eigen::Array3d phase_ = Eigen::Array3d::Zero();
};

}  // namespace ear
