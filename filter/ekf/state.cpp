#include "filter/ekf/state.h"

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

}  // namespace

Eigen::Matrix<double, 3, 2> tangent_basis(const Eigen::Vector3d& n) {
  // The shortest turn from z to n, applied to x and y.
  const double c = 1.0 / (1.0 + n.z());
  Eigen::Matrix<double, 3, 2> B;
  B << 1.0 - c * n.x() * n.x(), -c * n.x() * n.y(), -c * n.x() * n.y(), 1.0 - c * n.y() * n.y(), -n.x(), -n.y();
  return B;
}

void boxplus(State& x, const Eigen::Ref<const Eigen::VectorXd>& d) {
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
  x.odometer.time_offset += d(err::encoder_offset);
  x.odometer.reading_error += d.segment<2>(err::readings);
  apply_local(x.camera.T_BC0, d.segment<3>(err::camera), d.segment<3>(err::camera + 3));
  apply_local(x.camera.T_C0C1, d.segment<3>(err::stereo), d.segment<3>(err::stereo + 3));
  for (int camera = 0; camera < 2; ++camera) {
    LensError& lens = x.camera.lens_error[static_cast<std::size_t>(camera)];
    const auto change = d.segment<err::lens_size>(err::lens(camera));
    lens.focal_length += change(0);
    lens.principal_point += change.tail<2>();
  }
  x.camera.time_offset += d(err::time_offset);
  x.imu.accel_matrix *= Eigen::Matrix3d::Identity() + Eigen::Map<const Eigen::Matrix3d>(d.data() + err::accel_matrix);
  x.imu.gyro_matrix *= Eigen::Matrix3d::Identity() + Eigen::Map<const Eigen::Matrix3d>(d.data() + err::gyro_matrix);
  for (std::size_t i = 0; i < x.clones.size(); ++i) {
    const int at = err::clone(static_cast<int>(i));
    apply_invariant(x.clones[i].T_WB, d.segment<3>(at), d.segment<3>(at + 3));
  }
}

}  // namespace ear
