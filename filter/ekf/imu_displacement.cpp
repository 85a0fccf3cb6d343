#include "filter/ekf/imu_displacement.h"

#include <cmath>

#include "filter/ekf/propagation.h"

namespace ear {
namespace {

double squared(double value) { return value * value; }

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

}  // namespace ear
