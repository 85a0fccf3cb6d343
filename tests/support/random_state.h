// Random states for tests, from an engine the caller seeds.
#pragma once

#include <random>

#include "filter/ekf/state.h"

namespace ear::test {

inline Eigen::Vector3d random_vector(std::mt19937_64& rng, double sigma) {
  std::normal_distribution<double> normal(0.0, sigma);
  const double x = normal(rng), y = normal(rng), z = normal(rng);
  return {x, y, z};
}

inline Pose random_pose(std::mt19937_64& rng, double angle, double distance) {
  return {exp_so3(random_vector(rng, angle)), random_vector(rng, distance)};
}

/// A forward-looking camera (z forward along the body's x) with a little of everything, and a second 5 cm to its right.
inline CameraState random_cameras(std::mt19937_64& rng) {
  Eigen::Matrix3d R_BC;
  R_BC << 0, 0, 1, -1, 0, 0, 0, -1, 0;
  CameraState camera;
  camera.T_BC0 = {exp_so3(random_vector(rng, 0.1)) * R_BC, random_vector(rng, 0.05)};
  camera.T_C0C1 = {exp_so3(random_vector(rng, 0.01)), Eigen::Vector3d(0.05, 0, 0) + random_vector(rng, 0.001)};
  camera.time_offset = 1e-3;
  for (LensError& lens : camera.lens_error) {
    lens.focal_length = random_vector(rng, 3e-3).x();
    lens.principal_point = random_vector(rng, 3e-3).head<2>();
  }
  return camera;
}

/// The body somewhere, with `clones` past poses nearby.
inline State random_state(std::mt19937_64& rng, int clones) {
  State x;
  const Pose body = random_pose(rng, 1.0, 5.0);
  x.imu.R_WB = body.R;
  x.imu.p_WB = body.p;
  x.imu.v_W = random_vector(rng, 1.0);
  x.imu.b_g = random_vector(rng, 0.01);
  x.imu.b_a = random_vector(rng, 0.1);
  x.ground.n_W = (Eigen::Vector3d::UnitZ() + random_vector(rng, 0.2)).normalized();
  x.odometer.wheel_radius = {0.075, 0.0748};
  x.odometer.track_width = 0.4;
  x.odometer.T_BO = random_pose(rng, 0.05, 0.03);
  x.odometer.beam_offset = random_vector(rng, 0.01);
  x.camera = random_cameras(rng);
  for (int i = 0; i < clones; ++i) {
    x.clones.push_back(
        {static_cast<std::uint64_t>(i), {body.R * exp_so3(random_vector(rng, 0.1)), body.p + random_vector(rng, 0.3)}});
  }
  for (int axis = 0; axis < 3; ++axis) x.imu.accel_matrix.col(axis) += random_vector(rng, 0.01);
  for (int axis = 0; axis < 3; ++axis) x.imu.gyro_matrix.col(axis) += random_vector(rng, 0.01);
  return x;
}

}  // namespace ear::test
