#include "filter/start/start_fit.h"

#include <Eigen/Cholesky>
#include <Eigen/Geometry>

namespace ear {

template <int N>
double StartFit<N>::free_gravity() const {
  const Vector x = A_.ldlt().solve(b_);
  return x.template segment<3>(gravity).norm();
}

/// Gravity's size is a row along its present direction, again as the direction gets better.
template <int N>
std::optional<Eigen::Matrix<double, N, 1>> StartFit<N>::solve() const {
  constexpr double kSigma = 0.01;    // [m/s^2] chosen: of the known size
  constexpr double kWorstFit = 2.0;  // chosen: root mean square residual, in standard deviations
  constexpr int kIterations = 3;     // chosen
  Vector x = A_.ldlt().solve(b_);
  for (int i = 0; i < kIterations; ++i) {
    const Eigen::Vector3d along = x.template segment<3>(gravity).normalized() / kSigma;
    Eigen::Matrix<double, N, N> with_gravity = A_;
    with_gravity.template block<3, 3>(gravity, gravity) += along * along.transpose();
    Vector rhs = b_;
    rhs.template segment<3>(gravity) += along * (-kGravity_W.z() / kSigma);
    x = with_gravity.ldlt().solve(rhs);
  }
  const double squares = x.dot(A_ * x) - 2.0 * b_.dot(x) + cost_;
  return squares <= kWorstFit * kWorstFit * rows_ ? std::optional(x) : std::nullopt;
}

template class StartFit<9>;
template class StartFit<12>;

Eigen::Matrix3d turn_between(const Eigen::Vector3d& a, const Eigen::Vector3d& b) {
  return Eigen::Quaterniond::FromTwoVectors(a, b).toRotationMatrix();
}

ImuState start_state(TimeNs t_ns, const Eigen::Vector3d& v_B, const Eigen::Vector3d& gravity_B,
                     const Eigen::Vector3d& b_g, const Eigen::Vector3d& b_a) {
  ImuState state;
  state.t_ns = t_ns;
  state.R_WB = turn_between(gravity_B, kGravity_W);
  state.v_W = state.R_WB * v_B;
  state.b_g = b_g;
  state.b_a = b_a;
  return state;
}

}  // namespace ear
