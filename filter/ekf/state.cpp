#include "filter/ekf/state.h"

#include <algorithm>

#include "filter/ekf/turn_between.h"

namespace ear {
namespace {

void apply_invariant(Pose& T, const Eigen::Vector3d& theta, const Eigen::Vector3d& rho) {
  const Eigen::Matrix3d E = exp_so3(theta);
  T.R = renormalized(E * T.R);
  T.p = E * T.p + rho;
}

void apply_local(Pose& T, const Eigen::Vector3d& phi, const Eigen::Vector3d& dp) {
  T.R = renormalized(exp_so3(phi) * T.R);
  T.p += dp;
}

Eigen::Matrix<double, 6, 1> invariant_difference(const Pose& truth, const Pose& estimate) {
  const Eigen::Matrix3d E = truth.R * estimate.R.transpose();
  Eigen::Matrix<double, 6, 1> d;
  d << log_so3(E), truth.p - E * estimate.p;
  return d;
}

Eigen::Matrix<double, 6, 1> local_difference(const Pose& truth, const Pose& estimate) {
  Eigen::Matrix<double, 6, 1> d;
  d << log_so3(truth.R * estimate.R.transpose()), truth.p - estimate.p;
  return d;
}

/// The shortest rotation vector that turns unit vector a into unit vector b.
Eigen::Vector3d rotation_between(const Eigen::Vector3d& a, const Eigen::Vector3d& b) {
  return log_so3(turn_between(a, b));
}

}  // namespace

TimeNs imu_time(TimeNs camera_time_ns, const CameraState& camera) {
  return duration_ns(-static_cast<TimeNs>(std::llround(1e9 * camera.time_offset)), camera_time_ns);
}

TimeNs camera_time(TimeNs imu_time_ns, const CameraState& camera) {
  return duration_ns(static_cast<TimeNs>(std::llround(1e9 * camera.time_offset)), imu_time_ns);
}

Eigen::Matrix<double, 3, 2> tangent_basis(const Eigen::Vector3d& n) {
  // The shortest turn from z to n, applied to x and y.
  const double c = 1.0 / (1.0 + n.z());
  Eigen::Matrix<double, 3, 2> B;
  B << 1.0 - c * n.x() * n.x(), -c * n.x() * n.y(), -c * n.x() * n.y(), 1.0 - c * n.y() * n.y(), -n.x(), -n.y();
  return B;
}

void boxplus_in_place(State& x, const Eigen::Ref<const Eigen::VectorXd>& d) {
  const Eigen::Matrix3d E = exp_so3(d.segment<3>(err::theta));
  x.imu.R_WB = renormalized(E * x.imu.R_WB);
  x.imu.v_W = E * x.imu.v_W + d.segment<3>(err::nu);
  x.imu.p_WB = E * x.imu.p_WB + d.segment<3>(err::rho);
  x.imu.b_g += d.segment<3>(err::b_g);
  x.imu.b_a += d.segment<3>(err::b_a);
  x.ground.n_W = (E * exp_so3(tangent_basis(x.ground.n_W) * d.segment<2>(err::normal)) * x.ground.n_W).normalized();
  x.odometer.beam_offset += d.segment<kMaxBeams>(err::beams);
  x.odometer.wheel_radius.array() *= 1.0 + d.segment<2>(err::wheel_radius).array();
  x.odometer.track_width *= 1.0 + d(err::track_width);
  x.odometer.T_BO.R = renormalized(x.odometer.T_BO.R * exp_so3(d.segment<3>(err::odometer)));
  x.odometer.T_BO.p += d.segment<3>(err::axle);
  apply_local(x.camera.T_BC0, d.segment<3>(err::camera), d.segment<3>(err::camera + 3));
  apply_local(x.camera.T_C0C1, d.segment<3>(err::stereo), d.segment<3>(err::stereo + 3));
  for (int camera = 0; camera < 2; ++camera) {
    LensError& lens = x.camera.lens_error[static_cast<std::size_t>(camera)];
    const auto change = d.segment<err::lens_size>(err::lens(camera));
    lens.focal_length += change(0);
    lens.principal_point += change.tail<2>();
  }
  x.camera.time_offset += d(err::time_offset);
  for (std::size_t i = 0; i < x.clones.size(); ++i) {
    const int at = err::clone(static_cast<int>(i));
    apply_invariant(x.clones[i].T_WB, d.segment<3>(at), d.segment<3>(at + 3));
  }
}

State boxplus(const State& x, const Eigen::Ref<const Eigen::VectorXd>& d) {
  State result = x;
  boxplus_in_place(result, d);
  return result;
}

Eigen::VectorXd boxminus(const State& truth, const State& estimate) {
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
  d.segment<kMaxBeams>(err::beams) = truth.odometer.beam_offset - estimate.odometer.beam_offset;
  d.segment<6>(err::camera) = local_difference(truth.camera.T_BC0, estimate.camera.T_BC0);
  d.segment<6>(err::stereo) = local_difference(truth.camera.T_C0C1, estimate.camera.T_C0C1);
  for (int camera = 0; camera < 2; ++camera) {
    const LensError& a = truth.camera.lens_error[static_cast<std::size_t>(camera)];
    const LensError& b = estimate.camera.lens_error[static_cast<std::size_t>(camera)];
    d.segment<err::lens_size>(err::lens(camera)) << a.focal_length - b.focal_length,
        a.principal_point - b.principal_point;
  }
  d(err::time_offset) = truth.camera.time_offset - estimate.camera.time_offset;
  for (std::size_t i = 0; i < estimate.clones.size(); ++i) {
    d.segment<6>(err::clone(static_cast<int>(i))) = invariant_difference(truth.clones[i].T_WB, estimate.clones[i].T_WB);
  }
  return d;
}

}  // namespace ear
