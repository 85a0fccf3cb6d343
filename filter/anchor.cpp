#include "filter/anchor.h"

#include <cmath>

namespace ear {

Anchor Anchor::join(const NavState& last_W, const NavState& state_A, double yaw_sigma, double position_sigma) {
  const Eigen::Matrix3d D = (last_W.q_WB * state_A.q_WB.conjugate()).toRotationMatrix();
  const double yaw = std::atan2(D(1, 0) - D(0, 1), D(0, 0) + D(1, 1));
  Anchor anchor;
  anchor.q_WA = Eigen::Quaterniond(Eigen::AngleAxisd(yaw, Eigen::Vector3d::UnitZ()));
  anchor.p_WA = last_W.p_WB - anchor.q_WA * state_A.p_WB;
  anchor.start_A = state_A.p_WB;
  anchor.yaw_sigma = yaw_sigma;
  anchor.position_sigma = position_sigma;
  return anchor;
}

NavState Anchor::to_world(const NavState& state_A) const {
  NavState state = state_A;
  state.q_WB = (q_WA * state_A.q_WB).normalized();
  state.p_WB = q_WA * state_A.p_WB + p_WA;
  state.v_W = q_WA * state_A.v_W;
  return state;
}

/// A yaw error e of the anchor turns the vehicle, its velocity, and its way since the start, about z.
Eigen::Matrix<double, estimate_error::size, estimate_error::size> Anchor::to_world(
    const Eigen::Matrix<double, estimate_error::size, estimate_error::size>& covariance_A,
    const NavState& state_A) const {
  using namespace estimate_error;
  const Eigen::Matrix3d R = q_WA.toRotationMatrix();
  Eigen::Matrix<double, size, size> T = Eigen::Matrix<double, size, size>::Identity();
  for (const int block : {rotation, velocity, position}) T.block<3, 3>(block, block) = R;
  Eigen::Matrix<double, size, 1> by_yaw = Eigen::Matrix<double, size, 1>::Zero();
  by_yaw.segment<3>(rotation) = Eigen::Vector3d::UnitZ();
  by_yaw.segment<3>(velocity) = Eigen::Vector3d::UnitZ().cross(R * state_A.v_W);
  by_yaw.segment<3>(position) = Eigen::Vector3d::UnitZ().cross(R * (state_A.p_WB - start_A));
  Eigen::Matrix<double, size, size> P = T * covariance_A * T.transpose();
  P += yaw_sigma * yaw_sigma * by_yaw * by_yaw.transpose();
  P.diagonal().segment<3>(position).array() += position_sigma * position_sigma;
  return P;
}

}  // namespace ear
