#include "smoother/imu_factor.h"

#include <Eigen/Cholesky>

#include "smoother/factor.h"

namespace ear::smoother {

ImuFactor::ImuFactor(const ImuPreintegration& measured) : measured_(measured) {
  using Matrix15 = Eigen::Matrix<double, imu_error::size, imu_error::size>;
  whitening_ = measured.covariance().llt().matrixL().solve(Matrix15::Identity());
}

bool ImuFactor::Evaluate(double const* const* blocks, double* residual, double** jacobians) const {
  const Pose T_i = to_pose(blocks[0]);
  const Pose T_j = to_pose(blocks[2]);
  const Eigen::Map<const Eigen::Matrix<double, 9, 1>> m_i(blocks[1]);
  const Eigen::Map<const Eigen::Matrix<double, 9, 1>> m_j(blocks[3]);
  const double T = measured_.duration();
  const Eigen::Matrix3d R_BiW = T_i.R.transpose();

  Eigen::Matrix<double, 6, 1> bias;  // true less assumed
  bias << m_i.segment<3>(motion_entry::b_g) - measured_.b_g(), m_i.segment<3>(motion_entry::b_a) - measured_.b_a();
  const Eigen::Matrix<double, 9, 1> by_bias = measured_.J_bias() * bias;
  const Eigen::Vector3d gained_W = m_j.head<3>() - m_i.head<3>() - kGravity_W * T;
  const Eigen::Vector3d moved_W = T_j.p - T_i.p - m_i.head<3>() * T - 0.5 * kGravity_W * T * T;

  Eigen::Matrix<double, imu_error::size, 1> r;
  const Eigen::Vector3d xi = log_so3(R_BiW * T_j.R * measured_.R_BiBj().transpose() * exp_so3(-by_bias.head<3>()));
  r.segment<3>(imu_error::xi) = xi;
  r.segment<3>(imu_error::dv) = R_BiW * gained_W - measured_.dv_Bi() - by_bias.segment<3>(imu_error::dv);
  r.segment<3>(imu_error::dp) = R_BiW * moved_W - measured_.dp_Bi() - by_bias.segment<3>(imu_error::dp);
  r.tail<6>() = m_j.tail<6>() - m_i.tail<6>();
  Eigen::Map<Eigen::Matrix<double, imu_error::size, 1>>(residual, imu_error::size) = whitening_ * r;
  if (jacobians == nullptr) return true;

  const Eigen::Matrix3d J_turn = left_jacobian_inverse(xi) * R_BiW;
  if (jacobians[0] != nullptr) {
    Eigen::Matrix<double, imu_error::size, 7> J = Eigen::Matrix<double, imu_error::size, 7>::Zero();
    J.block<3, 3>(imu_error::xi, 0) = -J_turn;
    J.block<3, 3>(imu_error::dv, 0) = R_BiW * skew(gained_W);
    J.block<3, 3>(imu_error::dp, 0) = R_BiW * skew(moved_W);
    J.block<3, 3>(imu_error::dp, 3) = -R_BiW;
    store((whitening_ * J).eval(), jacobians[0]);
  }
  if (jacobians[1] != nullptr) {
    Eigen::Matrix<double, imu_error::size, 9> J = Eigen::Matrix<double, imu_error::size, 9>::Zero();
    J.block<3, 3>(imu_error::dv, motion_entry::v) = -R_BiW;
    J.block<3, 3>(imu_error::dp, motion_entry::v) = -R_BiW * T;
    J.block<9, 6>(0, motion_entry::b_g) = -measured_.J_bias();
    J.block<3, 3>(imu_error::xi, motion_entry::b_g) =
        -left_jacobian_inverse(-xi) * gamma<1>(by_bias.head<3>()) * measured_.J_bias().topLeftCorner<3, 3>();
    J.block<6, 6>(imu_error::b_g, motion_entry::b_g) = -Eigen::Matrix<double, 6, 6>::Identity();
    store((whitening_ * J).eval(), jacobians[1]);
  }
  if (jacobians[2] != nullptr) {
    Eigen::Matrix<double, imu_error::size, 7> J = Eigen::Matrix<double, imu_error::size, 7>::Zero();
    J.block<3, 3>(imu_error::xi, 0) = J_turn;
    J.block<3, 3>(imu_error::dp, 3) = R_BiW;
    store((whitening_ * J).eval(), jacobians[2]);
  }
  if (jacobians[3] != nullptr) {
    Eigen::Matrix<double, imu_error::size, 9> J = Eigen::Matrix<double, imu_error::size, 9>::Zero();
    J.block<3, 3>(imu_error::dv, motion_entry::v) = R_BiW;
    J.block<6, 6>(imu_error::b_g, motion_entry::b_g).setIdentity();
    store((whitening_ * J).eval(), jacobians[3]);
  }
  return true;
}

}  // namespace ear::smoother
