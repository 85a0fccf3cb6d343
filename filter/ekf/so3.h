// Rotations: exponential, logarithm, and the integrals that IMU integration needs. Standard results, e.g. Sola et al.,
// "A micro Lie theory" (2018); Gamma_m as in Hartley et al., "Contact-aided invariant EKF" (2020), eq. (61).
#pragma once

#include <Eigen/Core>

namespace ear {

/// [v]x, so that skew(v) * w = v x w.
[[nodiscard]] inline Eigen::Matrix3d skew(const Eigen::Vector3d& v) {
  Eigen::Matrix3d m;
  m << 0.0, -v.z(), v.y(), v.z(), 0.0, -v.x(), -v.y(), v.x(), 0.0;
  return m;
}

/// Gamma_m(phi) = sum over k of [phi]x^k / (k + m)!. Gamma_0 = Exp, Gamma_1 = left Jacobian, Gamma_2 = its integral.
/// `m` is 0, 1 or 2; phi in rad.
template <int m>
[[nodiscard]] Eigen::Matrix3d gamma(const Eigen::Vector3d& phi);

/// Rotation by the vector phi [rad].
[[nodiscard]] Eigen::Matrix3d exp_so3(const Eigen::Vector3d& phi);

/// Rotation vector of R [rad], of length at most pi.
[[nodiscard]] Eigen::Vector3d log_so3(const Eigen::Matrix3d& R);

/// Derivative of Gamma_m(phi) * a with respect to phi, by the series: u_k = phi x u_{k-1}, u_0 = a.
/// `m` is 1 or 2. Seven terms: below 1e-12 for the turn between two IMU samples (less than 0.1 rad).
template <int m>
[[nodiscard]] Eigen::Matrix3d gamma_derivative(const Eigen::Vector3d& phi, const Eigen::Vector3d& a);

/// Brings back to a rotation what many products have worn: one Newton step of the polar decomposition.
[[nodiscard]] Eigen::Matrix3d renormalized(const Eigen::Matrix3d& R);

}  // namespace ear
