// The least squares of a start in motion: velocity and gravity in the first body frame, of known size, and biases. For
// the rolling and the moving start; solved in a file of its own: Eigen's solvers are large to compile.
#pragma once

#include <Eigen/Core>
#include <optional>

#include "ear/calibration.h"
#include "ear/filter_config.h"
#include "ear/health.h"
#include "ear/types.h"
#include "filter/ekf/state.h"
#include "filter/ingest/imu_buffer.h"

namespace ear {

/// Chosen: root mean square residual of a start that fits, in standard deviations of noise that is guessed; their mean
/// square, in variances of noise that is known.
inline constexpr double kWorstFit = 2.0;

/// Unknowns: velocity [m/s], gravity [m/s^2], biases of gyroscope [rad/s] and accelerometer [m/s^2], in the body of the
/// first moment; then what the cameras' calibration is wrong by, where they show the motion: a turn of the left one,
/// R_BC = Exp(phi) R^ [rad], the time offset [s], a turn of the right one in the left one [rad],
/// and each one's LensError.
class StartFit {
 public:
  static constexpr int velocity = 0, gravity = 3, gyro_bias = 6, accel_bias = 9;  ///< where they begin
  static constexpr int motion_size = 12;                                          ///< of these
  static constexpr int camera_rotation = 12, time_offset = 15, stereo_rotation = 16, size = 25;
  static constexpr int lens_of(int camera) { return 19 + 3 * camera; }
  using Vector = Eigen::Matrix<double, size, 1>;
  using Matrix = Eigen::Matrix<double, size, size>;
  using MotionMatrix = Eigen::Matrix<double, motion_size, motion_size>;
  using Rows = Eigen::Matrix<double, 3, size>;

  /// Biases and calibration are zero, to within `prior_sigma`. `x`: where what is added is linearized.
  explicit StartFit(const Vector& prior_sigma, const Vector& x = Vector::Zero());
  /// z = H x + n; `variance` of each n.
  void add(const Rows& H, const Eigen::Vector3d& z, double variance);
  /// Normal equations A x = b.
  void add(const Matrix& A, const Vector& b) {
    A_ += A;
    b_ += b;
  }

  /// Nothing if the rows do not fit; they were linear.
  [[nodiscard]] std::optional<Vector> solve() const;
  /// The same whether they fit or not.
  [[nodiscard]] Vector solution() const;
  /// From x on, where what was added is linearized, gravity's known size included.
  [[nodiscard]] Vector step(const Vector& x) const { return step(x, b_); }
  /// The inverse of the covariance, likewise: of all, and of the motion alone.
  [[nodiscard]] Matrix information(const Vector& x) const;
  [[nodiscard]] MotionMatrix motion_information(const Vector& x) const;
  /// Are biases and calibration, but for the lenses, within so many standard deviations of the prior?
  [[nodiscard]] bool expected(const Vector& x, double sigmas) const;

 private:
  [[nodiscard]] Vector step(const Vector& x, const Vector& b) const;

  Vector prior_information_;
  Matrix A_;
  Vector b_;
  double cost_ = 0.0;
  double rows_ = 0.0;
};

/// What is known of the unknowns before, as standard deviations: nothing of velocity and gravity.
[[nodiscard]] StartFit::Vector start_sigma(const PriorConfig& prior, const Calibration& calibration);

/// Of a start in motion: a state to linearize at, or what it lacks.
struct StartAttempt {
  std::optional<ImuState> x;
  Reason lacks = Reason::none;
  std::optional<StartFit::MotionMatrix> information = std::nullopt;  ///< the inverse of its covariance, if known
  std::optional<ImuNoiseFactors> imu_noise = std::nullopt;           ///< on the stated noise, if known
};

/// The shortest turn that takes the direction of `a` to that of `b`; neither is zero.
[[nodiscard]] Eigen::Matrix3d turn_between(const Eigen::Vector3d& a, const Eigen::Vector3d& b);

/// The state at `t_ns` with these unknowns, gravity pointing down.
[[nodiscard]] ImuState start_state(TimeNs t_ns, const StartFit::Vector& x);

}  // namespace ear
