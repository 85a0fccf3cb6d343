#include "smoother/standstill_factor.h"

#include "smoother/factor.h"

namespace ear::smoother {

StandstillFactor::StandstillFactor(const StandstillConfig& config) {
  weight_ << Eigen::Vector3d::Constant(1.0 / config.rotation_sigma),
      Eigen::Vector3d::Constant(1.0 / config.position_sigma), Eigen::Vector3d::Constant(1.0 / config.velocity_sigma);
}

bool StandstillFactor::Evaluate(double const* const* blocks, double* residual, double** jacobians) const {
  const Pose T_i = to_pose(blocks[0]);
  const Pose T_j = to_pose(blocks[1]);
  const Eigen::Matrix3d R_BiW = T_i.R.transpose();
  const Eigen::Vector3d turn = log_so3(R_BiW * T_j.R);
  const Eigen::Vector3d moved_W = T_j.p - T_i.p;
  Eigen::Matrix<double, 9, 1> r;
  r << turn, R_BiW * moved_W, Eigen::Map<const Eigen::Vector3d>(blocks[2]);
  Eigen::Map<Eigen::Matrix<double, 9, 1>>(residual, 9) = weight_.cwiseProduct(r);
  if (jacobians == nullptr) return true;

  const Eigen::Matrix3d J_turn = left_jacobian_inverse(turn) * R_BiW;
  if (jacobians[0] != nullptr) {
    Eigen::Matrix<double, 9, 7> J = Eigen::Matrix<double, 9, 7>::Zero();
    J.block<3, 3>(0, 0) = -J_turn;
    J.block<3, 3>(3, 0) = R_BiW * skew(moved_W);
    J.block<3, 3>(3, 3) = -R_BiW;
    store((weight_.asDiagonal() * J).eval(), jacobians[0]);
  }
  if (jacobians[1] != nullptr) {
    Eigen::Matrix<double, 9, 7> J = Eigen::Matrix<double, 9, 7>::Zero();
    J.block<3, 3>(0, 0) = J_turn;
    J.block<3, 3>(3, 3) = R_BiW;
    store((weight_.asDiagonal() * J).eval(), jacobians[1]);
  }
  if (jacobians[2] != nullptr) {
    Eigen::Matrix<double, 9, 9> J = Eigen::Matrix<double, 9, 9>::Zero();
    J.block<3, 3>(6, motion_entry::v).setIdentity();
    store((weight_.asDiagonal() * J).eval(), jacobians[2]);
  }
  return true;
}

}  // namespace ear::smoother
