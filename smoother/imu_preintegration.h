// What the inertial samples between two frames i and j show of the motion, whatever the state at i: Forster et al.,
// "On-manifold preintegration" (2017), with the exact integrals of a rate and a force that are constant over each
// piece.
//
//   R_BiBj = prod Exp((w - b_g) dt),  dv = sum R (f - b_a) dt,  dp = sum (dv dt + R (f - b_a) dt^2 / 2),  all in B_i
#pragma once

#include <Eigen/Core>

#include "ear/calibration.h"

namespace ear::smoother {

/// Order of the errors: R = Exp(xi) R^ with xi in B_i; all others additive.
namespace imu_error {
inline constexpr int xi = 0, dv = 3, dp = 6, b_g = 9, b_a = 12, size = 15;
}

class ImuPreintegration {
 public:
  /// Biases that the samples are taken with [rad/s], [m/s^2]; what they turn out to be later is left to the
  /// derivatives.
  ImuPreintegration(const Eigen::Vector3d& b_g, const Eigen::Vector3d& b_a) : b_g_(b_g), b_a_(b_a) {}

  /// A piece of `dt` > 0 seconds with constant rate [rad/s] and specific force [m/s^2], as measured.
  void add(const Eigen::Vector3d& gyro_B, const Eigen::Vector3d& accel_B, double dt, const ImuCalibration& noise);

  /// From i over j to k: `next` begins where this one ends. Its samples are taken with the biases of this one, to first
  /// order.
  void append(const ImuPreintegration& next);

  [[nodiscard]] double duration() const { return duration_; }  ///< [s]
  [[nodiscard]] const Eigen::Matrix3d& R_BiBj() const { return R_BiBj_; }
  [[nodiscard]] const Eigen::Vector3d& dv_Bi() const { return dv_Bi_; }  ///< [m/s], without gravity
  [[nodiscard]] const Eigen::Vector3d& dp_Bi() const { return dp_Bi_; }  ///< [m], without gravity and first velocity
  [[nodiscard]] const Eigen::Vector3d& b_g() const { return b_g_; }
  [[nodiscard]] const Eigen::Vector3d& b_a() const { return b_a_; }
  /// Of (xi, dv, dp) by the biases (b_g, b_a): true less assumed.
  [[nodiscard]] const Eigen::Matrix<double, 9, 6>& J_bias() const { return J_bias_; }
  /// Of the whole error at j; the biases' part is their walk from i to j.
  [[nodiscard]] const Eigen::Matrix<double, imu_error::size, imu_error::size>& covariance() const { return Q_; }

 private:
  Eigen::Vector3d b_g_, b_a_;
  double duration_ = 0.0;
  Eigen::Matrix3d R_BiBj_ = Eigen::Matrix3d::Identity();
  Eigen::Vector3d dv_Bi_ = Eigen::Vector3d::Zero();
  Eigen::Vector3d dp_Bi_ = Eigen::Vector3d::Zero();
  Eigen::Matrix<double, 9, 6> J_bias_ = Eigen::Matrix<double, 9, 6>::Zero();
  Eigen::Matrix<double, imu_error::size, imu_error::size> Q_ =
      Eigen::Matrix<double, imu_error::size, imu_error::size>::Zero();
};

}  // namespace ear::smoother
