#include "smoother/wheel_chain.h"

#include "filter/ekf/so3.h"

namespace ear::smoother {

/// alpha_k = alpha_j + R_ij alpha_jk, and Exp(xi_k) R_ik = Exp(xi_j) R_ij Exp(xi_jk) R_jk.
WheelDisplacement chained(const WheelDisplacement& first, const WheelDisplacement& second) {
  const Eigen::Vector3d bias = first.b_g - second.b_g;
  const Eigen::Vector3d alpha_Bj =
      second.alpha_Bi + second.J_alpha_bias * bias +
      second.J_alpha_radius * (first.wheels.radius.cwiseQuotient(second.wheels.radius) - Eigen::Vector2d::Ones()) +
      second.J_alpha_track_width * (first.wheels.track_width / second.wheels.track_width - 1.0) +
      second.J_alpha_axle * (first.wheels.y_B - second.wheels.y_B);
  const Eigen::Matrix3d& R = first.R_BiBj;
  const Eigen::Vector3d alpha_Bi = R * alpha_Bj;
  const Eigen::Matrix3d J_alpha_xi = -skew(alpha_Bi);

  WheelDisplacement z = first;
  z.alpha_Bi += alpha_Bi;
  z.R_BiBj = renormalized(R * exp_so3(second.J_xi_bias * bias) * second.R_BiBj);
  Eigen::Matrix<double, 6, 6> F = Eigen::Matrix<double, 6, 6>::Identity();
  F.topRightCorner<3, 3>() = J_alpha_xi;
  Eigen::Matrix<double, 6, 6> G = Eigen::Matrix<double, 6, 6>::Zero();
  G.topLeftCorner<3, 3>() = R;
  G.bottomRightCorner<3, 3>() = R;
  z.covariance = F * first.covariance * F.transpose() + G * second.covariance * G.transpose();
  z.duration += second.duration;
  z.distance += second.distance;
  z.usable = first.usable && second.usable;
  z.J_alpha_normal.setZero();
  z.J_alpha_bias += J_alpha_xi * first.J_xi_bias + R * second.J_alpha_bias;
  z.J_alpha_radius += R * second.J_alpha_radius;
  z.J_alpha_track_width += R * second.J_alpha_track_width;
  z.J_alpha_axle += R * second.J_alpha_axle;
  z.J_xi_bias += R * second.J_xi_bias;
  return z;
}

}  // namespace ear::smoother
