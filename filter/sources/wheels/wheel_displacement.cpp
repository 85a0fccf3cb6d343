#include "filter/sources/wheels/wheel_displacement.h"

#include <algorithm>
#include <cmath>

#include "filter/ekf/propagation.h"

namespace ear {
namespace {

double squared(double value) { return value * value; }

}  // namespace

WheelModel wheel_model(const OdometerState& odometer) {
  WheelModel wheels;
  wheels.radius = odometer.wheel_radius;
  wheels.track_width = odometer.track_width;
  wheels.y_B = odometer.T_BO.R.col(1);
  return wheels;
}

WheelNoise wheel_noise(const OdometerConfig& odometer, const EncoderCalibration& encoder, const ImuCalibration& imu) {
  WheelNoise noise;
  noise.gyro = imu.gyro_noise;
  noise.reading = encoder.noise_counts * 2.0 * M_PI / static_cast<double>(encoder.resolution);
  noise.slip = odometer.slip;
  noise.side_slip = odometer.side_slip;
  noise.roughness = odometer.roughness;
  noise.normal_walk = odometer.normal_walk;
  return noise;
}

Displacement wheel_displacement(const State& x, const Covariance& P, const WheelIncrements& increments,
                                const ImuBuffer& samples, TimeNs to_ns, const WheelSetting& setting) {
  const OdometerState& odometer = x.odometer;
  const Eigen::Matrix3d R_BW = x.imu.R_WB.transpose();
  const Eigen::Vector3d n_B =
      setting.on_plane ? Eigen::Vector3d(R_BW * x.ground.n_W) : Eigen::Vector3d(odometer.T_BO.R.col(2));
  WheelPreintegration wheels(wheel_model(odometer), setting.noise);
  wheels.start(n_B, x.imu.b_g);
  Displacement result;
  if (to_ns <= x.imu.t_ns) return result;
  const bool complete = for_each_part(increments, x.imu.t_ns, to_ns, [&](const IncrementPart& part) {
    const MeanRate rate = samples.mean_rate(part.from_ns, part.to_ns);
    wheels.add_interval(rate.gyro_B, part.duration(), part.angle, rate.noise_factor);
    return true;
  });
  if (!complete) return result;
  const WheelDisplacement z = wheels.result();
  if (!z.usable) return result;

  // The axle's middle went alpha; the body turned about it.
  result.p_BiBj = z.alpha_Bi + odometer.T_BO.p - z.R_BiBj * odometer.T_BO.p;
  Eigen::Matrix<double, 3, err::camera> H = Eigen::Matrix<double, 3, err::camera>::Zero();
  H.middleCols<3>(err::b_g) = z.J_alpha_bias + skew(z.R_BiBj * odometer.T_BO.p) * z.J_xi_bias;
  H.middleCols<2>(err::wheel_radius) = z.J_alpha_radius;
  H.col(err::track_width) = z.J_alpha_track_width;
  H.middleCols<3>(err::axle) = Eigen::Matrix3d::Identity() - z.R_BiBj;
  H.middleCols<3>(err::odometer) = -z.J_alpha_axle * odometer.T_BO.R * skew(Eigen::Vector3d::UnitY());
  if (setting.on_plane) {
    H.middleCols<2>(err::normal) = -z.J_alpha_normal * skew(n_B) * R_BW * tangent_basis(x.ground.n_W);
  } else {
    H.middleCols<3>(err::odometer) -= z.J_alpha_normal * odometer.T_BO.R * skew(Eigen::Vector3d::UnitZ());
  }
  const Eigen::Matrix<double, 3, 6> J_noise =
      (Eigen::Matrix<double, 3, 6>() << Eigen::Matrix3d::Identity(), skew(z.R_BiBj * odometer.T_BO.p)).finished();
  const double turning = log_so3(z.R_BiBj).norm();  // [rad]
  const Eigen::Vector3d side_B = odometer.T_BO.R.col(1) * (setting.side_slip_turn * turning);
  result.covariance = H * P.matrix().topLeftCorner<err::camera, err::camera>() * H.transpose() +
                      J_noise * z.covariance * J_noise.transpose() + side_B * side_B.transpose();
  result.covariance.diagonal().array() += squared(setting.speed_sigma * z.duration);
  result.available = result.p_BiBj.allFinite() && result.covariance.allFinite();
  return result;
}

}  // namespace ear
