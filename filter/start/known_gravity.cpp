#include "filter/start/known_gravity.h"

#include <Eigen/Cholesky>

#include "filter/ekf/state.h"

namespace ear {

template <int N>
Eigen::Matrix<double, N, 1> solve_symmetric(const Eigen::Matrix<double, N, N>& A,
                                            const Eigen::Matrix<double, N, 1>& b) {
  return A.ldlt().solve(b);
}

template <int N>
Eigen::Matrix<double, N, 1> solve_with_known_gravity(const Eigen::Matrix<double, N, N>& A,
                                                     const Eigen::Matrix<double, N, 1>& b, int first) {
  constexpr double kSigma = 0.01;  // [m/s^2] of the known size
  constexpr int kIterations = 3;
  Eigen::Matrix<double, N, 1> x = solve_symmetric(A, b);
  for (int i = 0; i < kIterations; ++i) {
    const Eigen::Vector3d along = x.template segment<3>(first).normalized() / kSigma;
    Eigen::Matrix<double, N, N> with_gravity = A;
    with_gravity.template block<3, 3>(first, first) += along * along.transpose();
    Eigen::Matrix<double, N, 1> rhs = b;
    rhs.template segment<3>(first) += along * (-kGravity_W.z() / kSigma);
    x = solve_symmetric(with_gravity, rhs);
  }
  return x;
}

// For the moving and the rolling start.
template <int N>
using Square = Eigen::Matrix<double, N, N>;
template <int N>
using Column = Eigen::Matrix<double, N, 1>;
template Column<9> solve_symmetric(const Square<9>&, const Column<9>&);
template Column<9> solve_with_known_gravity(const Square<9>&, const Column<9>&, int);
template Column<12> solve_with_known_gravity(const Square<12>&, const Column<12>&, int);

}  // namespace ear
