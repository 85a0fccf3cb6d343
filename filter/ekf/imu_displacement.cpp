#include "filter/ekf/imu_displacement.h"

#include <algorithm>

#include "filter/ekf/propagation.h"

namespace ear {

Eigen::Matrix3d ImuMotion::by_state(const Covariance& P) const {
  return H * P.matrix().topLeftCorner<err::imu_size, err::imu_size>() * H.transpose();
}

/// With positions counted from i on, p_BiBj = R_i^T p_j. By the invariant error, p_j moves by rho_j - [p_j]x theta_j,
/// and R_i^T turns against theta_i.
ImuMotion imu_motion(const ImuState& x, const ImuBuffer& samples, TimeNs to_ns, const ImuCalibration& imu) {
  ImuMotion motion;
  ImuState end = x;
  end.p_WB.setZero();
  const ImuState begin = end;
  Eigen::Vector3d turned_B = Eigen::Vector3d::Zero(), gained_B = Eigen::Vector3d::Zero();
  ImuNoiseFactors worst;
  samples.for_each_piece(
      x.t_ns, to_ns,
      [&](const Eigen::Vector3d& gyro_B, const Eigen::Vector3d& accel_B, double dt, const ImuNoiseFactors& factors) {
        end = integrate(end, gyro_B, accel_B, dt);
        turned_B += gyro_B * dt;
        gained_B += accel_B * dt;
        worst = {std::max(worst.gyro, factors.gyro), std::max(worst.accel, factors.accel)};
        motion.duration += dt;
      });
  if (!(motion.duration > 0.0)) return motion;
  // The error goes on as if all samples were their mean: a frame is short.
  const ImuCalibration noise = with_factors(imu, worst);
  const ErrorTransition error =
      error_transition(begin, turned_B / motion.duration, gained_B / motion.duration, motion.duration, noise);
  const Eigen::Matrix3d R_BW = x.R_WB.transpose();
  motion.T_BiBj = {R_BW * end.R_WB, R_BW * end.p_WB};
  motion.gained_W = end.v_W - begin.v_W;
  Eigen::Matrix<double, 3, err::imu_size> H_end = Eigen::Matrix<double, 3, err::imu_size>::Zero();
  H_end.middleCols<3>(err::theta) = -R_BW * skew(end.p_WB);
  H_end.middleCols<3>(err::rho) = R_BW;
  motion.H = H_end * error.Phi - H_end;
  motion.turn_variance = error.Q(err::theta, err::theta);
  // White noise over the time T is not one error for all of it: of the accelerometer's, T^3 / 3 comes to the position
  // where one error would bring T^3 / 4, and of the gyroscope's T^5 / 20 where one would bring T^5 / 36.
  const auto spread = [&motion](int bias, double density, double share) -> Eigen::Matrix3d {
    const Eigen::Matrix3d J = motion.H.middleCols<3>(bias);
    return share * density * density / motion.duration * J * J.transpose();
  };
  motion.covariance = spread(err::b_a, noise.accel_noise, 4.0 / 3.0) + spread(err::b_g, noise.gyro_noise, 9.0 / 5.0);
  return motion;
}

Displacement imu_displacement(const ImuMotion& motion, const Covariance& P) {
  Displacement result;
  result.p_BiBj = motion.T_BiBj.p;
  result.covariance = motion.by_state(P) + motion.covariance;
  result.available = motion.duration > 0.0 && result.p_BiBj.allFinite() && result.covariance.allFinite();
  return result;
}

}  // namespace ear
