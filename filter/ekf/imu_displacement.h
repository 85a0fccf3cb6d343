// How far the body goes until the next frame by the inertial samples, p^I of (13). docs/anomaly.md.
#pragma once

#include <Eigen/Core>

#include "ear/calibration.h"
#include "filter/ekf/covariance.h"
#include "filter/ekf/displacement.h"
#include "filter/ekf/state.h"
#include "filter/ingest/imu_buffer.h"

namespace ear {

/// The IMU's samples from i to j, from the state at i on. Vectors are in B_i.
struct ImuMotion {
  double duration = 0.0;  ///< [s]
  Pose T_BiBj;
  Eigen::Matrix<double, 3, err::imu_size> H = Eigen::Matrix<double, 3, err::imu_size>::Zero();  ///< p by the error at i
  Eigen::Matrix3d covariance = Eigen::Matrix3d::Zero();  ///< of p, by the noise of the samples meanwhile [m^2]
  Eigen::Vector3d gained_W = Eigen::Vector3d::Zero();    ///< velocity, in W [m/s]
  double turn_variance = 0.0;                            ///< of R, one axis, by the same [rad^2]

  /// Covariance of p by the error at i, whose covariance is `P` [m^2].
  [[nodiscard]] Eigen::Matrix3d by_state(const Covariance& P) const;
};

/// Integrates the samples from x.t_ns to `to_ns`.
[[nodiscard]] ImuMotion imu_motion(const ImuState& x, const ImuBuffer& samples, TimeNs to_ns,
                                   const ImuCalibration& imu);

/// `P`: covariance of the error at i.
[[nodiscard]] Displacement imu_displacement(const ImuMotion& motion, const Covariance& P);

}  // namespace ear
