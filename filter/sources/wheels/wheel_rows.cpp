#include "filter/sources/wheels/wheel_rows.h"

#include <algorithm>

namespace ear {

void WheelRows::measure_at(double lever) {
  residual(speed) += lever * residual(yaw_rate);
  H.row(speed) += lever * H.row(yaw_rate);
  H(speed, ground_column(err::track_width)) -= lever * residual(yaw_rate);  // the lever grows with it
  J_gyro.row(speed) += lever * J_gyro.row(yaw_rate);
}

void WheelRows::count_readings(const OdometerState& odometer, int last, double duration) {
  Eigen::RowVector2d J = Eigen::RowVector2d::Constant(-1.0 / duration);
  J(last) = 1.0 / duration;
  residual(speed) -= J.dot(odometer.reading_error);
  H.block<1, 2>(speed, ground_column(err::readings)) = J;
}

WheelRows linearize_wheels(const State& x, const Eigen::Matrix3d& R_WB, const Eigen::Vector3d& v_W,
                           const WheelIncrement& turn, const Eigen::Vector3d& gyro_B, OdometerModel model,
                           bool normal_known) {
  using Eigen::Vector3d;
  const OdometerState& odometer = x.odometer;
  const bool terrain = model == OdometerModel::terrain;
  const bool on_plane = terrain && normal_known;
  const Eigen::Matrix3d& R_BO = odometer.T_BO.R;
  const Vector3d rate = x.imu.rate_B(gyro_B);
  const Vector3d v_O = R_WB.transpose() * v_W + rate.cross(odometer.T_BO.p);
  const Vector3d y = R_BO.col(1);
  const Vector3d n = on_plane ? Vector3d(R_WB.transpose() * x.ground.n_W) : Vector3d(R_BO.col(2));
  const Vector3d f = y.cross(n).normalized();                                                      // (6)-(8)
  const Eigen::Vector2d wheel = odometer.wheel_radius.cwiseProduct(turn.angle) / turn.duration();  // rim speeds
  const double r = odometer.wheel_radius.mean();

  WheelRows rows;
  rows.rim_speed = wheel.mean();
  const double turning = (wheel(1) - wheel(0)) / odometer.track_width;
  rows.wheel_speed = rows.rim_speed + (terrain ? r * y.dot(rate) : 0.0);  // (5)
  rows.residual << rows.wheel_speed - f.dot(v_O), -y.dot(v_O), -n.dot(v_O), turning - n.dot(rate);

  // Derivatives of y and n by the state's errors. They are taken where side and slope put the velocity, along f: there
  // that of f drops out. What it has across is an error, and would be taken for a reading of where the wheels point.
  const Vector3d path = f * f.dot(v_O);
  constexpr int nu = ground_column(err::nu), b_g = ground_column(err::b_g), normal = ground_column(err::normal);
  constexpr int radius = ground_column(err::wheel_radius), track_width = ground_column(err::track_width);
  constexpr int phi = ground_column(err::odometer), axle = ground_column(err::axle);
  const Eigen::Matrix3d y_phi = -R_BO * skew(Vector3d::UnitY());
  Eigen::Matrix3d n_phi = Eigen::Matrix3d::Zero();
  Eigen::Matrix<double, 3, 2> n_delta = Eigen::Matrix<double, 3, 2>::Zero();
  if (on_plane) {
    n_delta = -skew(n) * R_WB.transpose() * tangent_basis(x.ground.n_W);
  } else {
    n_phi = -R_BO * skew(Vector3d::UnitZ());
  }

  // How the predictions move with v_O (by nu and by the rate), then with the directions, then with the wheels.
  rows.direction << f.transpose(), y.transpose(), n.transpose();
  const Eigen::Matrix3d v_rate = -skew(odometer.T_BO.p);
  rows.J_gyro.topRows<3>() = rows.direction * v_rate;
  rows.J_gyro.row(WheelRows::yaw_rate) = n.transpose();
  if (terrain) rows.J_gyro.row(WheelRows::speed) -= r * y.transpose();
  rows.J_gyro *= x.imu.gyro_matrix;

  auto& H = rows.H;
  H.middleCols<3>(nu).topRows<3>() = rows.direction * R_WB.transpose();
  H.middleCols<3>(b_g) = -rows.J_gyro;
  H.middleCols<3>(axle).topRows<3>() = rows.direction * skew(rate);
  H.block<1, 3>(WheelRows::side, phi) = path.transpose() * y_phi;
  H.block<1, 3>(WheelRows::slope, phi) = path.transpose() * n_phi;
  H.block<1, 3>(WheelRows::yaw_rate, phi) = rate.transpose() * n_phi;
  H.block<1, 2>(WheelRows::slope, normal) = path.transpose() * n_delta;
  H.block<1, 2>(WheelRows::yaw_rate, normal) = rate.transpose() * n_delta;
  H.block<1, 2>(WheelRows::speed, radius) = -0.5 * wheel.transpose();
  if (terrain) {
    H.block<1, 2>(WheelRows::speed, radius) -= 0.5 * y.dot(rate) * odometer.wheel_radius.transpose();
    H.block<1, 3>(WheelRows::speed, phi) = -r * rate.transpose() * y_phi;
  }
  H.block<1, 2>(WheelRows::yaw_rate, radius) << wheel(0) / odometer.track_width, -wheel(1) / odometer.track_width;
  H(WheelRows::yaw_rate, track_width) = turning;
  return rows;
}

/// With Gaussian a and b: E (a . b)^2 = tr(A B) + tr(C C) + (tr C)^2.
double speed_left_out(const Eigen::Matrix3d& R_WO, const Eigen::Matrix3d& phi, const Eigen::Matrix3d& phi_nu,
                      const Eigen::Matrix3d& nu) {
  const Eigen::Matrix3d forward_by_phi = -R_WO * skew(Eigen::Vector3d::UnitX());
  const Eigen::Matrix3d forward = forward_by_phi * phi * forward_by_phi.transpose();
  const Eigen::Matrix3d forward_nu = forward_by_phi * phi_nu;
  const double mean = forward_nu.trace();
  return std::max(0.0, (forward * nu).trace() + (forward_nu * forward_nu).trace() + mean * mean);
}

}  // namespace ear
