// A vehicle over a flat floor: what its beams, encoders and IMU read. Its own geometry, not the filter's.
#pragma once

#include <Eigen/Geometry>
#include <array>
#include <cmath>
#include <limits>
#include <random>

#include "ear/calibration.h"
#include "ear/types.h"

namespace ear::test {

constexpr double kWheelRadius = 0.075;

/// Three beams, nearly downwards; the axle is 5 cm below the body's origin.
inline Calibration vehicle_with_beams() {
  Calibration calibration;
  EncoderCalibration axle;
  axle.T_BO.translation() = Eigen::Vector3d(-0.02, 0.0, -0.05);
  calibration.encoder = axle;
  LaserCalibration lasers;
  lasers.beams = {{"front_left", {0.10, 0.10, -0.03}, Eigen::Vector3d(0.02, 0.01, -1.0).normalized()},
                  {"front_right", {0.10, -0.11, -0.03}, Eigen::Vector3d(-0.01, -0.02, -1.0).normalized()},
                  {"rear", {-0.16, 0.0, -0.02}, Eigen::Vector3d(0.0, 0.01, -1.0).normalized()}};
  calibration.lasers = lasers;
  return calibration;
}

/// Wheels `height` [m] above the floor, body pitched (nose-down positive) and rolled about the axle's middle [rad].
struct VehiclePose {
  double height = 0.0, pitch = 0.0, roll = 0.0;

  [[nodiscard]] Eigen::Matrix3d R_WB() const {
    return (Eigen::AngleAxisd(roll, Eigen::Vector3d::UnitX()) * Eigen::AngleAxisd(pitch, Eigen::Vector3d::UnitY()))
        .toRotationMatrix();
  }

  /// Distance from the beam's origin to the floor along it [m].
  [[nodiscard]] double range(const Calibration& calibration, std::size_t beam) const {
    const LaserBeam& laser = calibration.lasers->beams[beam];
    const Eigen::Matrix3d R = R_WB();
    const double origin_z = kWheelRadius + height + (R * (laser.p_BL - calibration.encoder->T_BO.translation())).z();
    return origin_z / -(R * laser.d_B).z();
  }
};

/// Reads the beams with noise [m].
inline LaserSample read_beams(const Calibration& calibration, TimeNs t_ns, const VehiclePose& pose, double noise,
                              std::mt19937_64& rng) {
  std::normal_distribution<double> normal(0.0, 1.0);
  LaserSample sample{t_ns, {}};
  for (std::size_t i = 0; i < calibration.lasers->beams.size(); ++i) {
    const double range = pose.range(calibration, i) + noise * normal(rng);
    const bool returns = range >= calibration.lasers->range_min && range <= calibration.lasers->range_max;
    sample.range.push_back(returns ? range : std::numeric_limits<double>::quiet_NaN());
  }
  return sample;
}

}  // namespace ear::test
