#include "src/mavlink/odometry_message.h"

#include <algorithm>

#include "filter/ekf/so3.h"

namespace ear::mavlink {
namespace {

/// Between x forward, y left, z up and x forward, y right, z down, and the reverse: half a turn about x.
Eigen::Matrix3d half_turn() { return Eigen::Vector3d(1.0, -1.0, -1.0).asDiagonal(); }

/// d(position, rotation) / d(estimate's error).
Eigen::Matrix<double, 6, estimate_error::size> pose_jacobian(const Eigen::Matrix3d& R_VW) {
  Eigen::Matrix<double, 6, estimate_error::size> J = decltype(J)::Zero();
  J.block<3, 3>(0, estimate_error::position) = half_turn();
  J.block<3, 3>(3, estimate_error::rotation) = R_VW;  // Exp(e_W) R = R Exp(R^T e_W): about the vehicle's own axes
  return J;
}

/// d(velocity, angular rate) / d(estimate's error).
Eigen::Matrix<double, 6, estimate_error::size> velocity_jacobian(const Eigen::Matrix3d& R_VW,
                                                                 const Eigen::Matrix3d& R_BV,
                                                                 const Eigen::Vector3d& v_W) {
  Eigen::Matrix<double, 6, estimate_error::size> J = decltype(J)::Zero();
  J.block<3, 3>(0, estimate_error::velocity) = R_VW;
  J.block<3, 3>(0, estimate_error::rotation) = R_VW * skew(v_W);
  J.block<3, 3>(3, estimate_error::gyro_bias) = -R_BV.transpose();
  return J;
}

}  // namespace

Eigen::Matrix3d mounting_of(const EncoderCalibration& encoder) { return encoder.T_BO.linear() * half_turn(); }

Eigen::Matrix3d mounting_of(double roll, double pitch, double yaw) {
  const Eigen::Matrix3d R_OB =
      (Eigen::AngleAxisd(yaw, Eigen::Vector3d::UnitZ()) * Eigen::AngleAxisd(pitch, Eigen::Vector3d::UnitY()) *
       Eigen::AngleAxisd(roll, Eigen::Vector3d::UnitX()))
          .toRotationMatrix();
  return R_OB.transpose() * half_turn();
}

OdometryMessage make_odometry(const NavState& x, const Eigen::Vector3d& rate_B, const Eigen::Matrix3d& R_BV) {
  const Eigen::Matrix3d R_WV = x.q_WB.toRotationMatrix() * R_BV;
  OdometryMessage message;
  message.time_us = static_cast<std::uint64_t>(std::max<TimeNs>(x.t_ns, 0)) / 1000;
  message.p_L = half_turn() * x.p_WB;
  message.q_LV = Eigen::Quaterniond(Eigen::Matrix3d(half_turn() * R_WV)).normalized();
  if (message.q_LV.w() < 0.0) message.q_LV.coeffs() *= -1.0;
  message.v_V = R_WV.transpose() * x.v_W;
  message.w_V = R_BV.transpose() * rate_B;
  return message;
}

void set_covariances(OdometryMessage& message, const NavState& x, const EstimateCovariance& P, double rate_variance,
                     const Eigen::Matrix3d& R_BV) {
  const Eigen::Matrix3d R_VW = (x.q_WB.toRotationMatrix() * R_BV).transpose();
  const Eigen::Matrix<double, 6, estimate_error::size> J_pose = pose_jacobian(R_VW);
  const Eigen::Matrix<double, 6, estimate_error::size> J_velocity = velocity_jacobian(R_VW, R_BV, x.v_W);
  message.pose_covariance = J_pose * P * J_pose.transpose();
  message.velocity_covariance = J_velocity * P * J_velocity.transpose();
  message.velocity_covariance.bottomRightCorner<3, 3>().diagonal().array() += rate_variance;
}

}  // namespace ear::mavlink
