#include "smoother/wheel_factor.h"

#include <Eigen/Cholesky>

#include "smoother/factor.h"

namespace ear::smoother {

OdometerState with_errors(const OdometerState& given, const double* wheels) {
  OdometerState odometer = given;
  odometer.wheel_radius.array() *= 1.0 + Eigen::Map<const Eigen::Array2d>(wheels + wheel_entry::radius);
  odometer.track_width *= 1.0 + wheels[wheel_entry::track_width];
  odometer.T_BO.R *= exp_so3(Eigen::Map<const Eigen::Vector3d>(wheels + wheel_entry::turn));
  return odometer;
}

WheelFactor::WheelFactor(const WheelDisplacement& measured, const OdometerState& given,
                         const Eigen::Matrix3d& covariance)
    : measured_(measured), given_(given) {
  whitening_ = covariance.llt().matrixL().solve(Eigen::Matrix3d::Identity());
}

bool WheelFactor::Evaluate(double const* const* blocks, double* residual, double** jacobians) const {
  const Pose T_i = to_pose(blocks[0]);
  const Pose T_j = to_pose(blocks[2]);
  const Eigen::Map<const Eigen::Vector3d> b_g(blocks[1] + motion_entry::b_g);
  const OdometerState odometer = with_errors(given_, blocks[3]);
  const Eigen::Vector3d y_B = odometer.T_BO.R.col(1);
  const Eigen::Vector3d& p_BO = odometer.T_BO.p;
  const WheelDisplacement& z = measured_;

  const Eigen::Vector3d alpha_Bi =
      z.alpha_Bi + z.J_alpha_bias * (b_g - z.b_g) +
      z.J_alpha_radius * (odometer.wheel_radius.cwiseQuotient(z.wheels.radius) - Eigen::Vector2d::Ones()) +
      z.J_alpha_track_width * (odometer.track_width / z.wheels.track_width - 1.0) +
      z.J_alpha_axle * (y_B - z.wheels.y_B);
  const Eigen::Matrix3d R_BiW = T_i.R.transpose();
  const Eigen::Vector3d lever_W = T_j.R * p_BO;
  const Eigen::Vector3d moved_W = lever_W + T_j.p - T_i.p;  // from the body's origin at i
  Eigen::Map<Eigen::Vector3d>(residual, 3) = whitening_ * (alpha_Bi + p_BO - R_BiW * moved_W);
  if (jacobians == nullptr) return true;

  const Eigen::Matrix3d to_i = whitening_ * R_BiW;
  if (jacobians[0] != nullptr) {
    Eigen::Matrix<double, 3, 7> J;
    J << -to_i * skew(moved_W), to_i, Eigen::Vector3d::Zero();
    store(J, jacobians[0]);
  }
  if (jacobians[1] != nullptr) {
    Eigen::Matrix<double, 3, 9> J;
    J.setZero();
    J.middleCols<3>(motion_entry::b_g) = whitening_ * z.J_alpha_bias;
    store(J, jacobians[1]);
  }
  if (jacobians[2] != nullptr) {
    Eigen::Matrix<double, 3, 7> J;
    J << to_i * skew(lever_W), -to_i, Eigen::Vector3d::Zero();
    store(J, jacobians[2]);
  }
  if (jacobians[3] != nullptr) {
    Eigen::Matrix<double, 3, 6> J;
    const Eigen::Map<const Eigen::Vector3d> turn(blocks[3] + wheel_entry::turn);
    J.leftCols<2>() = whitening_ * z.J_alpha_radius * given_.wheel_radius.cwiseQuotient(z.wheels.radius).asDiagonal();
    J.col(wheel_entry::track_width) = whitening_ * z.J_alpha_track_width * (given_.track_width / z.wheels.track_width);
    J.middleCols<3>(wheel_entry::turn) =
        -whitening_ * z.J_alpha_axle * odometer.T_BO.R * skew(Eigen::Vector3d::UnitY()) * gamma<1>(-turn);
    store(J, jacobians[3]);
  }
  return true;
}

}  // namespace ear::smoother
