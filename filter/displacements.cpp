#include "filter/displacements.h"

#include <algorithm>
#include <cmath>

#include "filter/propagation.h"

namespace ear {
namespace {

constexpr TimeNs kMissedReading = 50'000'000;  // [ns] without wheel readings: the displacement has a gap

double squared(double value) { return value * value; }

/// Adds the turns from `from_ns` to `to_ns`; were there readings all the way?
bool integrate_turns(const TurnsBetween& turns, const ImuBuffer& samples, TimeNs from_ns, TimeNs to_ns,
                     WheelPreintegration& wheels) {
  TimeNs now_ns = from_ns;
  for (std::size_t i = 0; i < turns.size() && now_ns < to_ns; ++i) {
    const WheelIncrement& turn = turns[i];
    const bool last = i + 1 == turns.size();
    if (turn.to_ns <= now_ns && !last) continue;
    if (turn.from_ns > now_ns + kMissedReading || (last && to_ns > turn.to_ns + kMissedReading)) return false;
    const TimeNs end_ns = last ? to_ns : std::min(to_ns, turn.to_ns);
    const double dt = seconds_between(now_ns, end_ns);
    const MeanRate rate = samples.mean_rate(now_ns, end_ns);
    wheels.add_interval(rate.gyro_B, dt, turn.angle * (dt / turn.duration()), rate.noise_factor);
    now_ns = end_ns;
  }
  return now_ns >= to_ns;
}

}  // namespace

/// Position errors follow from R = Exp(theta) R^, v = Exp(theta) v^ + nu at i, where
///   p_BiBj = R^T (v T + g T^2 / 2) + what the IMU measures:
/// the velocity in the body moves by R^^T nu, gravity by R^^T [g]x theta; biases act through the samples.
ImuMotion imu_motion(const ImuState& x, const ImuBuffer& samples, TimeNs to_ns, const ImuCalibration& noise) {
  ImuState body = x;  // from B_i on, without gravity and velocity
  body.R_WB.setIdentity();
  body.v_W.setZero();
  body.p_WB.setZero();
  Eigen::Matrix3d v_ba = Eigen::Matrix3d::Zero(), p_ba = Eigen::Matrix3d::Zero();
  Eigen::Matrix3d xi_bg = Eigen::Matrix3d::Zero(), v_bg = Eigen::Matrix3d::Zero(), p_bg = Eigen::Matrix3d::Zero();
  double v_variance = 0.0, pv_covariance = 0.0;  // noise is alike in all directions: rotations leave it as it is
  ImuMotion motion;
  const auto add = [&](const Eigen::Vector3d& gyro_B, const Eigen::Vector3d& accel_B, double dt,
                       const ImuNoiseFactors& factors) {
    const Eigen::Vector3d phi = (gyro_B - x.b_g) * dt;
    const Eigen::Vector3d f_B = accel_B - x.b_a;
    const Eigen::Matrix3d R_G1 = body.R_WB * gamma<1>(phi);
    const Eigen::Matrix3d R_G2 = body.R_WB * gamma<2>(phi);
    const Eigen::Vector3d dv = R_G1 * f_B * dt;
    const Eigen::Vector3d dp = R_G2 * f_B * dt * dt;
    // By the bias of the rate: through the rotation before this piece, and within it.
    p_bg += v_bg * dt - skew(dp) * xi_bg - body.R_WB * gamma_derivative<2>(phi, f_B) * (dt * dt * dt);
    v_bg += -skew(dv) * xi_bg - body.R_WB * gamma_derivative<1>(phi, f_B) * (dt * dt);
    xi_bg -= R_G1 * dt;
    p_ba += v_ba * dt - R_G2 * (dt * dt);
    v_ba -= R_G1 * dt;

    const double accel = squared(noise.accel_noise * factors.accel);
    motion.position_variance += (2.0 * pv_covariance + (v_variance + accel * dt / 3.0) * dt) * dt;
    pv_covariance += (v_variance + 0.5 * accel * dt) * dt;
    v_variance += accel * dt;
    motion.rotation_variance += squared(noise.gyro_noise * factors.gyro) * dt;

    body.p_WB += body.v_W * dt + dp;
    body.v_W += dv;
    body.R_WB = renormalized(body.R_WB * exp_so3(phi));
    motion.duration += dt;
  };
  samples.for_each_piece(x.t_ns, to_ns, add);

  const double T = motion.duration;
  const Eigen::Matrix3d R_BW = x.R_WB.transpose();
  motion.p_BiBj = R_BW * (x.v_W * T + 0.5 * kGravity_W * T * T) + body.p_WB;
  motion.R_BiBj = body.R_WB;
  motion.H.middleCols<3>(err::theta) = 0.5 * T * T * R_BW * skew(kGravity_W);
  motion.H.middleCols<3>(err::nu) = T * R_BW;
  motion.H.middleCols<3>(err::b_g) = p_bg;
  motion.H.middleCols<3>(err::b_a) = p_ba;
  return motion;
}

Displacement imu_displacement(const ImuMotion& motion, const Covariance& P) {
  Displacement result;
  result.p_BiBj = motion.p_BiBj;
  result.covariance = motion.H * P.matrix().topLeftCorner<err::imu_size, err::imu_size>() * motion.H.transpose();
  result.covariance.diagonal().array() += motion.position_variance;
  result.available = motion.duration > 0.0 && result.p_BiBj.allFinite() && result.covariance.allFinite();
  return result;
}

WheelNoise wheel_noise(const OdometerConfig& odometer, const Calibration& calibration) {
  const EncoderCalibration& encoder = *calibration.encoder;
  WheelNoise noise;
  noise.gyro = calibration.imu.gyro_noise;
  noise.reading = encoder.noise_counts * 2.0 * M_PI / static_cast<double>(encoder.resolution);
  noise.slip = odometer.slip;
  noise.side_slip = odometer.side_slip;
  noise.roughness = odometer.roughness;
  noise.normal_walk = odometer.normal_walk;
  return noise;
}

Displacement wheel_displacement(const State& x, const Covariance& P, const TurnsBetween& turns,
                                const ImuBuffer& samples, TimeNs to_ns, const WheelSetting& setting) {
  const OdometerState& odometer = x.odometer;
  const Eigen::Matrix3d R_BW = x.imu.R_WB.transpose();
  const Eigen::Vector3d n_B =
      setting.on_plane ? Eigen::Vector3d(R_BW * x.ground.n_W) : Eigen::Vector3d(odometer.T_BO.R.col(2));
  WheelPreintegration wheels(setting.wheels, setting.noise);
  wheels.start(n_B, x.imu.b_g);
  Displacement result;
  if (to_ns <= x.imu.t_ns || !integrate_turns(turns, samples, x.imu.t_ns, to_ns, wheels)) return result;
  const WheelDisplacement z = wheels.result();
  if (!z.usable) return result;

  // The axle's middle went alpha; the body turned about it.
  result.p_BiBj = z.alpha_Bi + odometer.T_BO.p - z.R_BiBj * odometer.T_BO.p;
  Eigen::Matrix<double, 3, err::camera> H = Eigen::Matrix<double, 3, err::camera>::Zero();
  H.middleCols<3>(err::b_g) = z.J_alpha_bias + skew(z.R_BiBj * odometer.T_BO.p) * z.J_xi_bias;
  H.middleCols<2>(err::wheel_radius) = z.J_alpha_radius;
  H.col(err::track_width) = z.J_alpha_track_width;
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
