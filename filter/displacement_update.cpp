#include "filter/displacement_update.h"

namespace ear {

WheelModel wheel_model(const OdometerState& odometer) {
  WheelModel wheels;
  wheels.radius = odometer.wheel_radius;
  wheels.track_width = odometer.track_width;
  wheels.y_B = odometer.T_BO.R.col(1);
  return wheels;
}

DisplacementRows linearize_displacement(const State& x, int i, const WheelDisplacement& z) {
  const Pose& T_WBi = x.clones[static_cast<std::size_t>(i)].T_WB;
  const Eigen::Matrix3d R_BiW = T_WBi.R.transpose();
  const Eigen::Vector3d p_WO = x.imu.R_WB * x.odometer.T_BO.p + x.imu.p_WB;
  const Eigen::Vector3d p_WOi = T_WBi.R * x.odometer.T_BO.p + T_WBi.p;
  const Eigen::Vector3d n_Bi = R_BiW * x.ground.n_W;
  const WheelModel wheels = wheel_model(x.odometer);

  const Eigen::Vector3d alpha_Bi =
      z.alpha_Bi + z.J_alpha_bias * (x.imu.b_g - z.b_g) + z.J_alpha_normal * (n_Bi - z.n_Bi) +
      z.J_alpha_radius * (wheels.radius.cwiseQuotient(z.wheels.radius) - Eigen::Vector2d::Ones()) +
      z.J_alpha_track_width * (wheels.track_width / z.wheels.track_width - 1.0) +
      z.J_alpha_axle * (wheels.y_B - z.wheels.y_B);

  DisplacementRows rows;
  rows.residual = alpha_Bi - R_BiW * (p_WO - p_WOi);
  rows.covariance = z.covariance.topLeftCorner<3, 3>();

  // n_Bi turns with the error theta of the body's rotation now, by which the normal's error is counted, against that of
  // the clone: d n_Bi = -[n_Bi]x R_BiW (theta + B delta - theta_i).
  const Eigen::Matrix3d J_alpha_turn = -z.J_alpha_normal * skew(n_Bi) * R_BiW;
  const Eigen::Matrix3d H_theta = -R_BiW * skew(p_WO) - J_alpha_turn;
  rows.H.middleCols<3>(err::theta) = H_theta;
  rows.H.middleCols<3>(err::rho) = R_BiW;
  rows.H.middleCols<3>(err::b_g) = -z.J_alpha_bias;
  rows.H.middleCols<2>(err::normal) = -J_alpha_turn * tangent_basis(x.ground.n_W);
  rows.H.middleCols<2>(err::wheel_radius) = -z.J_alpha_radius;
  rows.H.col(err::track_width) = -z.J_alpha_track_width;
  rows.H.middleCols<3>(err::odometer) = z.J_alpha_axle * x.odometer.T_BO.R * skew(Eigen::Vector3d::UnitY());
  rows.H_clone << -H_theta, -R_BiW;
  return rows;
}

}  // namespace ear
