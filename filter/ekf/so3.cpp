#include "filter/ekf/so3.h"

#include <Eigen/Geometry>
#include <array>
#include <cmath>

namespace ear {

template <int m>
Eigen::Matrix3d gamma(const Eigen::Vector3d& phi) {
  static_assert(m >= 0 && m <= 2);
  constexpr std::array<double, 7> kFactorial = {1.0, 1.0, 2.0, 6.0, 24.0, 120.0, 720.0};
  const double x2 = phi.squaredNorm();
  const double x = std::sqrt(x2);
  double a = 0.0;  // factor of [phi]x
  double b = 0.0;  // factor of [phi]x^2
  if (x < 1e-3) {
    a = 1.0 / kFactorial[m + 1] - x2 / kFactorial[m + 3];
    b = 1.0 / kFactorial[m + 2] - x2 / kFactorial[m + 4];
  } else if constexpr (m == 0) {
    a = std::sin(x) / x;
    b = (1.0 - std::cos(x)) / x2;
  } else if constexpr (m == 1) {
    a = (1.0 - std::cos(x)) / x2;
    b = (x - std::sin(x)) / (x2 * x);
  } else {
    a = (x - std::sin(x)) / (x2 * x);
    b = (0.5 * x2 + std::cos(x) - 1.0) / (x2 * x2);
  }
  const Eigen::Matrix3d S = skew(phi);
  return Eigen::Matrix3d::Identity() / kFactorial[m] + a * S + b * S * S;
}

template Eigen::Matrix3d gamma<0>(const Eigen::Vector3d& phi);
template Eigen::Matrix3d gamma<1>(const Eigen::Vector3d& phi);
template Eigen::Matrix3d gamma<2>(const Eigen::Vector3d& phi);

Eigen::Matrix3d exp_so3(const Eigen::Vector3d& phi) { return gamma<0>(phi); }

Eigen::Vector3d log_so3(const Eigen::Matrix3d& R) {
  const Eigen::Quaterniond q(R);
  const double s = q.vec().norm();
  if (s < 1e-12) return 2.0 * q.vec() * (q.w() < 0.0 ? -1.0 : 1.0);
  const double angle = 2.0 * std::atan2(s, std::abs(q.w()));
  return q.vec() * ((q.w() < 0.0 ? -angle : angle) / s);
}

template <int m>
Eigen::Matrix3d gamma_derivative(const Eigen::Vector3d& phi, const Eigen::Vector3d& a) {
  static_assert(m == 1 || m == 2);
  const Eigen::Matrix3d S = skew(phi);
  double factorial = m == 2 ? 2.0 : 1.0;  // (k + m)! at k = 0
  Eigen::Vector3d u = a;
  Eigen::Matrix3d D = Eigen::Matrix3d::Zero();  // d u_k / d phi
  Eigen::Matrix3d sum = Eigen::Matrix3d::Zero();
  for (int k = 1; k <= 7; ++k) {
    D = S * D - skew(u);
    u = S * u;
    factorial *= k + m;
    sum += D / factorial;
  }
  return sum;
}

template Eigen::Matrix3d gamma_derivative<1>(const Eigen::Vector3d& phi, const Eigen::Vector3d& a);
template Eigen::Matrix3d gamma_derivative<2>(const Eigen::Vector3d& phi, const Eigen::Vector3d& a);

Eigen::Matrix3d renormalized(const Eigen::Matrix3d& R) {
  return R * (1.5 * Eigen::Matrix3d::Identity() - 0.5 * R.transpose() * R);
}

}  // namespace ear
