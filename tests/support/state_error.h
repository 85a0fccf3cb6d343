// The error of a state in both directions, for tests: boxplus (filter/ekf/state.h) by value, and what undoes it.
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <cmath>

#include "filter/ekf/state.h"

namespace ear::test {

/// x with the error d applied.
[[nodiscard]] inline State with_error(State x, const Eigen::Ref<const Eigen::VectorXd>& d) {
  boxplus(x, d);
  return x;
}

/// The errors that no sensor shows, one in each column: a turn of everything about gravity, and shifts along x, y, z.
[[nodiscard]] inline Eigen::MatrixXd unobservable(const State& x) {
  Eigen::MatrixXd N = Eigen::MatrixXd::Zero(x.error_size(), 4);
  const auto add_pose = [&N](int theta, int rho) {
    N.block<3, 1>(theta, 0) = Eigen::Vector3d::UnitZ();
    N.block<3, 3>(rho, 1).setIdentity();
  };
  add_pose(err::theta, err::rho);
  for (int i = 0; i < static_cast<int>(x.clones.size()); ++i) add_pose(err::clone(i), err::clone(i) + 3);
  return N;
}

/// Theta and rho between two poses.
[[nodiscard]] inline Eigen::Matrix<double, 6, 1> invariant_difference(const Pose& truth, const Pose& estimate) {
  const Eigen::Matrix3d E = truth.R * estimate.R.transpose();
  Eigen::Matrix<double, 6, 1> d;
  d << log_so3(E), truth.p - E * estimate.p;
  return d;
}

/// Phi and dp between two poses of cameras.
[[nodiscard]] inline Eigen::Matrix<double, 6, 1> local_difference(const Pose& truth, const Pose& estimate) {
  Eigen::Matrix<double, 6, 1> d;
  d << log_so3(truth.R * estimate.R.transpose()), truth.p - estimate.p;
  return d;
}

/// The shortest rotation vector that turns unit vector a into unit vector b, which is not opposite to it.
[[nodiscard]] inline Eigen::Vector3d rotation_between(const Eigen::Vector3d& a, const Eigen::Vector3d& b) {
  const Eigen::Vector3d axis = a.cross(b);
  const double sine = axis.norm();
  return sine > 0.0 ? Eigen::Vector3d(axis * (std::atan2(sine, a.dot(b)) / sine)) : axis;
}

/// The error d for which with_error(estimate, d) is `truth`. Both have the same clones.
[[nodiscard]] inline Eigen::VectorXd boxminus(const State& truth, const State& estimate) {
  Eigen::VectorXd d(estimate.error_size());
  const Eigen::Matrix3d E = truth.imu.R_WB * estimate.imu.R_WB.transpose();
  d.segment<3>(err::theta) = log_so3(E);
  d.segment<3>(err::nu) = truth.imu.v_W - E * estimate.imu.v_W;
  d.segment<3>(err::rho) = truth.imu.p_WB - E * estimate.imu.p_WB;
  d.segment<3>(err::b_g) = truth.imu.b_g - estimate.imu.b_g;
  d.segment<3>(err::b_a) = truth.imu.b_a - estimate.imu.b_a;
  const Eigen::Vector3d& n = estimate.ground.n_W;
  d.segment<2>(err::normal) = tangent_basis(n).transpose() * rotation_between(n, E.transpose() * truth.ground.n_W);
  d.segment<2>(err::wheel_radius) =
      truth.odometer.wheel_radius.cwiseQuotient(estimate.odometer.wheel_radius).array() - 1.0;
  d(err::track_width) = truth.odometer.track_width / estimate.odometer.track_width - 1.0;
  d.segment<3>(err::odometer) = log_so3(estimate.odometer.T_BO.R.transpose() * truth.odometer.T_BO.R);
  d.segment<3>(err::axle) = truth.odometer.T_BO.p - estimate.odometer.T_BO.p;
  d(err::encoder_offset) = truth.odometer.time_offset - estimate.odometer.time_offset;
  d.segment<2>(err::readings) = truth.odometer.reading_error - estimate.odometer.reading_error;
  d.segment<kMaxBeams>(err::beams) = truth.odometer.beam_offset - estimate.odometer.beam_offset;
  d.segment<6>(err::camera) = local_difference(truth.camera.T_BC0, estimate.camera.T_BC0);
  d.segment<6>(err::stereo) = local_difference(truth.camera.T_C0C1, estimate.camera.T_C0C1);
  for (int camera = 0; camera < 2; ++camera) {
    const LensError& a = truth.camera.lens_error[static_cast<std::size_t>(camera)];
    const LensError& b = estimate.camera.lens_error[static_cast<std::size_t>(camera)];
    d.segment<err::lens_size>(err::lens(camera)) << a.focal_length - b.focal_length,
        a.principal_point - b.principal_point;
  }
  const auto matrix_error = [](const Eigen::Matrix3d& true_M, const Eigen::Matrix3d& M) {
    return (M.inverse() * true_M - Eigen::Matrix3d::Identity()).eval();
  };
  d.segment<9>(err::accel_matrix) = matrix_error(truth.imu.accel_matrix, estimate.imu.accel_matrix).reshaped();
  d.segment<9>(err::gyro_matrix) = matrix_error(truth.imu.gyro_matrix, estimate.imu.gyro_matrix).reshaped();
  d(err::time_offset) = truth.camera.time_offset - estimate.camera.time_offset;
  for (std::size_t i = 0; i < estimate.clones.size(); ++i) {
    d.segment<6>(err::clone(static_cast<int>(i))) = invariant_difference(truth.clones[i].T_WB, estimate.clones[i].T_WB);
  }
  return d;
}

}  // namespace ear::test
