#include "filter/state.h"

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

}  // namespace

void boxplus_in_place(State& x, const Eigen::Ref<const Eigen::VectorXd>& d) {
  const Eigen::Matrix3d E = exp_so3(d.segment<3>(err::theta));
  x.imu.R_WB = renormalized(E * x.imu.R_WB);
  x.imu.v_W = E * x.imu.v_W + d.segment<3>(err::nu);
  x.imu.p_WB = E * x.imu.p_WB + d.segment<3>(err::rho);
  x.imu.b_g += d.segment<3>(err::b_g);
  x.imu.b_a += d.segment<3>(err::b_a);
  apply_local(x.camera.T_BC0, d.segment<3>(err::camera), d.segment<3>(err::camera + 3));
  apply_local(x.camera.T_C0C1, d.segment<3>(err::stereo), d.segment<3>(err::stereo + 3));
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
  d.segment<6>(err::camera) = local_difference(truth.camera.T_BC0, estimate.camera.T_BC0);
  d.segment<6>(err::stereo) = local_difference(truth.camera.T_C0C1, estimate.camera.T_C0C1);
  d(err::time_offset) = truth.camera.time_offset - estimate.camera.time_offset;
  for (std::size_t i = 0; i < estimate.clones.size(); ++i) {
    d.segment<6>(err::clone(static_cast<int>(i))) = invariant_difference(truth.clones[i].T_WB, estimate.clones[i].T_WB);
  }
  return d;
}

}  // namespace ear
