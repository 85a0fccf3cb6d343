#include "smoother/imu_preintegration.h"

#include "filter/ekf/so3.h"

namespace ear::smoother {
namespace {
double squared(double value) { return value * value; }
}  // namespace

void ImuPreintegration::add(const Eigen::Vector3d& gyro_B, const Eigen::Vector3d& accel_B, double dt,
                            const ImuCalibration& noise) {
  const Eigen::Vector3d phi = (gyro_B - b_g_) * dt;
  const Eigen::Vector3d f_B = accel_B - b_a_;
  const Eigen::Matrix3d R_G1 = R_BiBj_ * gamma<1>(phi);
  const Eigen::Matrix3d R_G2 = R_BiBj_ * gamma<2>(phi);
  const Eigen::Vector3d v_step = R_G1 * f_B * dt;
  const Eigen::Vector3d p_step = R_G2 * f_B * dt * dt;

  // What an error of the rate, and one of the force, each constant over the piece, do to (xi, dv, dp).
  Eigen::Matrix<double, 9, 6> B = Eigen::Matrix<double, 9, 6>::Zero();
  B.block<3, 3>(imu_error::xi, 0) = -R_G1 * dt;
  B.block<3, 3>(imu_error::dv, 0) = -R_BiBj_ * gamma_derivative<1>(phi, f_B) * (dt * dt);
  B.block<3, 3>(imu_error::dp, 0) = -R_BiBj_ * gamma_derivative<2>(phi, f_B) * (dt * dt * dt);
  B.block<3, 3>(imu_error::dv, 3) = -R_G1 * dt;
  B.block<3, 3>(imu_error::dp, 3) = -R_G2 * (dt * dt);

  Eigen::Matrix<double, imu_error::size, imu_error::size> F =
      Eigen::Matrix<double, imu_error::size, imu_error::size>::Identity();
  F.block<3, 3>(imu_error::dv, imu_error::xi) = -skew(v_step);
  F.block<3, 3>(imu_error::dp, imu_error::xi) = -skew(p_step);
  F.block<3, 3>(imu_error::dp, imu_error::dv).diagonal().setConstant(dt);
  F.block<9, 6>(imu_error::xi, imu_error::b_g) = B;
  J_bias_ = (F.topLeftCorner<9, 9>() * J_bias_ + B).eval();

  // White noise of density s has the variance s^2 / dt in a mean over dt; it enters where a bias would.
  Q_ = (F * Q_ * F.transpose()).eval();
  Q_.topLeftCorner<9, 9>() += squared(noise.gyro_noise) / dt * B.leftCols<3>() * B.leftCols<3>().transpose() +
                              squared(noise.accel_noise) / dt * B.rightCols<3>() * B.rightCols<3>().transpose();
  Q_.diagonal().segment<3>(imu_error::b_g).array() += squared(noise.gyro_random_walk) * dt;
  Q_.diagonal().segment<3>(imu_error::b_a).array() += squared(noise.accel_random_walk) * dt;

  dp_Bi_ += dv_Bi_ * dt + p_step;
  dv_Bi_ += v_step;
  R_BiBj_ = renormalized(R_BiBj_ * exp_so3(phi));
  duration_ += dt;
}

/// Exp(xi_k) R_ik = Exp(xi_j) R_ij Exp(xi_jk) R_jk, so xi_k = xi_j + R_ij xi_jk; the others likewise.
void ImuPreintegration::append(const ImuPreintegration& next) {
  Eigen::Matrix<double, 6, 1> bias;
  bias << b_g_ - next.b_g_, b_a_ - next.b_a_;
  const Eigen::Matrix<double, 9, 1> by_bias = next.J_bias_ * bias;
  const Eigen::Vector3d dv_Bi = R_BiBj_ * (next.dv_Bi_ + by_bias.segment<3>(imu_error::dv));
  const Eigen::Vector3d dp_Bi = R_BiBj_ * (next.dp_Bi_ + by_bias.segment<3>(imu_error::dp));
  const double T = next.duration_;

  Eigen::Matrix<double, 9, 9> turn = Eigen::Matrix<double, 9, 9>::Zero();
  for (const int at : {imu_error::xi, imu_error::dv, imu_error::dp}) turn.block<3, 3>(at, at) = R_BiBj_;
  Eigen::Matrix<double, imu_error::size, imu_error::size> F =
      Eigen::Matrix<double, imu_error::size, imu_error::size>::Identity();
  F.block<3, 3>(imu_error::dv, imu_error::xi) = -skew(dv_Bi);
  F.block<3, 3>(imu_error::dp, imu_error::xi) = -skew(dp_Bi);
  F.block<3, 3>(imu_error::dp, imu_error::dv).diagonal().setConstant(T);
  F.block<9, 6>(imu_error::xi, imu_error::b_g) = turn * next.J_bias_;
  Eigen::Matrix<double, imu_error::size, imu_error::size> G =
      Eigen::Matrix<double, imu_error::size, imu_error::size>::Identity();
  G.topLeftCorner<9, 9>() = turn;
  Q_ = (F * Q_ * F.transpose() + G * next.Q_ * G.transpose()).eval();
  J_bias_ = (F.topLeftCorner<9, 9>() * J_bias_ + turn * next.J_bias_).eval();

  dp_Bi_ += dv_Bi_ * T + dp_Bi;
  dv_Bi_ += dv_Bi;
  R_BiBj_ = renormalized(R_BiBj_ * exp_so3(by_bias.head<3>()) * next.R_BiBj_);
  duration_ += T;
}

}  // namespace ear::smoother
