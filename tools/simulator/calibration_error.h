// How the calibration that the estimator is given differs from the true one.
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>

#include "ear/calibration.h"
#include "tools/simulator/random.h"

namespace ear::simulator {

/// What is wrong with one calibration: errors that a rig which was measured with care still has. Rotations are rotation
/// vectors; what has several axes is drawn per axis.
struct CalibrationErrors {
  struct Camera {
    double focal_length = 0.0;                                  ///< of fu and fv, a share of them
    Eigen::Vector2d principal_point = Eigen::Vector2d::Zero();  ///< [px]
  };
  struct Beam {
    Eigen::Vector3d rotation_B = Eigen::Vector3d::Zero();  ///< of its direction [rad]
    Eigen::Vector3d origin_B = Eigen::Vector3d::Zero();    ///< [m]
  };
  Eigen::Vector3d rig_rotation_B = Eigen::Vector3d::Zero();       ///< of both cameras, about the left one [rad]
  Eigen::Vector3d rig_position_B = Eigen::Vector3d::Zero();       ///< of both cameras [m]
  Eigen::Vector3d stereo_rotation_C0 = Eigen::Vector3d::Zero();   ///< of the right camera, about itself [rad]
  Eigen::Vector3d stereo_position_C0 = Eigen::Vector3d::Zero();   ///< of the right camera [m]
  std::array<Camera, 2> cameras;                                  ///< left, right
  double wheel_radius = 0.0;                                      ///< of both, a share of it
  double radius_difference = 0.0;                                 ///< left less right, a share of the radius
  double track_width = 0.0;                                       ///< a share of it
  Eigen::Vector3d odometer_rotation_B = Eigen::Vector3d::Zero();  ///< [rad]
  Eigen::Vector3d odometer_position_B = Eigen::Vector3d::Zero();  ///< [m]
  std::array<Beam, 3> beams;
  double camera_time_offset = 0.0;   ///< [s]
  double encoder_time_offset = 0.0;  ///< [s]
  double laser_time_offset = 0.0;    ///< [s]
  /// What the accelerometer's true bias is larger by [m/s^2]: a rig with such errors has one that nobody removed.
  Eigen::Vector3d accel_bias = Eigen::Vector3d::Zero();
  /// Of the gyroscope's matrix, which nobody measured: scales, and what an axis measures of turns about another.
  Eigen::Matrix3d gyro_matrix = Eigen::Matrix3d::Zero();
};

/// Independent normal draws, of a random stream that nothing else uses. One sigma at factor 1: cameras to body 0.2
/// degrees and 1 mm, right camera against left 0.02 degrees and 0.05 mm, focal lengths 0.1 %, principal points 0.5 px,
/// wheel radius 0.4 % in common and 0.1 % between left and right, track width 0.5 %, odometer to body 0.3 degrees and
/// 3 mm, beams 0.3 degrees and 2 mm, times of cameras, encoders and lasers 2 ms each. The accelerometer's bias at the
/// start is then one of 0.08 m/s^2 per axis in all, 0.03 of it from draw_imu_biases(), and each entry of the
/// gyroscope's matrix is off by 0.3 %. Another factor scales all of them; 0 is no error.
[[nodiscard]] CalibrationErrors draw_calibration_errors(std::uint64_t seed, double factor);

/// The true calibration with these errors in it, and an exact gyroscope.
[[nodiscard]] Calibration with_errors(Calibration truth, const CalibrationErrors& errors);

/// Errors of fixed sizes, of which `rng` draws signs and axes: wheel radius 0.3 % (left against right 0.03 %), track
/// width 0.3 %, odometer, beams and cameras 0.2 degrees (the stereo pair within itself 0.02 degrees), camera-IMU time
/// 1 ms. Positions and intrinsics are right. Older figures and the bounds of tests were measured with them.
[[nodiscard]] Calibration with_fixed_errors(Calibration truth, Rng& rng);

}  // namespace ear::simulator
