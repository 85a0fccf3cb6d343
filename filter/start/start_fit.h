// The least squares of a start in motion: velocity and gravity in the first body frame, of known size, and biases. For
// the rolling and the moving start; solved in a file of its own: Eigen's solvers are large to compile.
#pragma once

#include <Eigen/Core>
#include <optional>

#include "ear/types.h"
#include "filter/ekf/state.h"

namespace ear {

/// N unknowns: velocity [m/s], gravity [m/s^2], and biases, the accelerometer's last.
template <int N>
class StartFit {
 public:
  static constexpr int velocity = 0, gravity = 3, gyro_bias = 6, accel_bias = N - 3;  ///< where they begin
  using Vector = Eigen::Matrix<double, N, 1>;
  using Rows = Eigen::Matrix<double, 3, N>;

  /// What is known of a bias before: zero, with this standard deviation, each axis.
  void expect(int bias, double sigma) { A_.diagonal().template segment<3>(bias).setConstant(1.0 / (sigma * sigma)); }
  /// z = H x + n; `variance` of each n.
  void add(const Rows& H, const Eigen::Vector3d& z, double variance) {
    A_ += H.transpose() * H / variance;
    b_ += H.transpose() * z / variance;
    cost_ += z.squaredNorm() / variance;
    rows_ += 3.0;
  }

  /// The size of gravity as the rows alone show it [m/s^2].
  [[nodiscard]] double free_gravity() const;
  /// Nothing if it does not fit.
  [[nodiscard]] std::optional<Vector> solve() const;

 private:
  Eigen::Matrix<double, N, N> A_ = Eigen::Matrix<double, N, N>::Zero();
  Vector b_ = Vector::Zero();
  double cost_ = 0.0;
  double rows_ = 0.0;
};

/// The shortest turn that takes the direction of `a` to that of `b`; neither is zero.
[[nodiscard]] Eigen::Matrix3d turn_between(const Eigen::Vector3d& a, const Eigen::Vector3d& b);

/// With velocity `v_B` and gravity `gravity_B` in the body at `t_ns`.
[[nodiscard]] ImuState start_state(TimeNs t_ns, const Eigen::Vector3d& v_B, const Eigen::Vector3d& gravity_B,
                                   const Eigen::Vector3d& b_g, const Eigen::Vector3d& b_a);

}  // namespace ear
