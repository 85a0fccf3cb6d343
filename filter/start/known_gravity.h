// Least squares over gravity, among others, whose size is known and whose direction is not.
#pragma once

#include <Eigen/Cholesky>

#include "filter/ekf/state.h"

namespace ear {

/// Solves A x = b, the normal equations of a fit whose unknowns from `first` on are gravity's reaction -g in some frame
/// [m/s^2]. Its size is a row along the present direction, again as the direction gets better.
template <int N>
[[nodiscard]] Eigen::Matrix<double, N, 1> solve_with_known_gravity(const Eigen::Matrix<double, N, N>& A,
                                                                   const Eigen::Matrix<double, N, 1>& b, int first) {
  constexpr double kSigma = 0.01;  // [m/s^2] of the known size
  constexpr int kIterations = 3;
  Eigen::Matrix<double, N, 1> x = A.ldlt().solve(b);
  for (int i = 0; i < kIterations; ++i) {
    const Eigen::Vector3d along = x.template segment<3>(first).normalized() / kSigma;
    Eigen::Matrix<double, N, N> with_gravity = A;
    with_gravity.template block<3, 3>(first, first) += along * along.transpose();
    Eigen::Matrix<double, N, 1> rhs = b;
    rhs.template segment<3>(first) += along * (-kGravity_W.z() / kSigma);
    x = with_gravity.ldlt().solve(rhs);
  }
  return x;
}

}  // namespace ear
