// Least squares over gravity, among others, whose size is known and whose direction is not. Of the sizes that the
// starts have, and in a file of its own: Eigen's solvers are large to compile.
#pragma once

#include <Eigen/Core>

namespace ear {

/// Solves A x = b; A is symmetric and not negative.
template <int N>
[[nodiscard]] Eigen::Matrix<double, N, 1> solve_symmetric(const Eigen::Matrix<double, N, N>& A,
                                                          const Eigen::Matrix<double, N, 1>& b);

/// Solves A x = b, the normal equations of a fit whose unknowns from `first` on are gravity's reaction -g in some frame
/// [m/s^2]. Its size is a row along the present direction, again as the direction gets better.
template <int N>
[[nodiscard]] Eigen::Matrix<double, N, 1> solve_with_known_gravity(const Eigen::Matrix<double, N, N>& A,
                                                                   const Eigen::Matrix<double, N, 1>& b, int first);

}  // namespace ear
