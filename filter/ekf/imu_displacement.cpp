#include "filter/ekf/imu_displacement.h"

#include "filter/ekf/propagation.h"

namespace ear {

/// With positions counted from i on, p_BiBj = R_i^T p_j. By the invariant error, p_j moves by rho_j - [p_j]x theta_j,
/// and R_i^T turns against theta_i.
ImuMotion imu_motion(const ImuState& x, const ImuBuffer& samples, TimeNs to_ns, const ImuCalibration& imu) {
  ImuMotion motion;
  ImuState end = x;
  end.p_WB.setZero();
  ErrorTransition error;
  samples.for_each_piece(
      x.t_ns, to_ns,
      [&](const Eigen::Vector3d& gyro_B, const Eigen::Vector3d& accel_B, double dt, const ImuNoiseFactors& factors) {
        chain(error, error_transition(end, gyro_B, accel_B, dt, with_factors(imu, factors)));
        end = integrate(end, gyro_B, accel_B, dt);
        motion.duration += dt;
      });
  const Eigen::Matrix3d R_BW = x.R_WB.transpose();
  motion.p_BiBj = R_BW * end.p_WB;
  motion.R_BiBj = R_BW * end.R_WB;
  Eigen::Matrix<double, 3, err::imu_size> H_end = Eigen::Matrix<double, 3, err::imu_size>::Zero();
  H_end.middleCols<3>(err::theta) = -R_BW * skew(end.p_WB);
  H_end.middleCols<3>(err::rho) = R_BW;
  motion.H = H_end * error.Phi - H_end;
  motion.covariance = H_end * error.Q * H_end.transpose();
  return motion;
}

Displacement imu_displacement(const ImuMotion& motion, const Covariance& P) {
  Displacement result;
  result.p_BiBj = motion.p_BiBj;
  result.covariance = motion.H * P.matrix().topLeftCorner<err::imu_size, err::imu_size>() * motion.H.transpose();
  result.covariance += motion.covariance;
  result.available = motion.duration > 0.0 && result.p_BiBj.allFinite() && result.covariance.allFinite();
  return result;
}

}  // namespace ear
