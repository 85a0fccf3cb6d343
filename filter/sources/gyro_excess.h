// Did the bias of the gyroscope jump? Then the images show another turn than the gyroscope by the same rate, however
// the vehicle turns. docs/filter.md, "Gaps and jumps".
#pragma once

#include <Eigen/Core>

#include "filter/ekf/covariance.h"
#include "filter/ekf/noise_score.h"
#include "filter/ingest/limits.h"
#include "filter/sources/seen_turn.h"

namespace ear {

/// A Kalman filter of what explains turns beyond the gyroscope's: a bias, which may change, and any linear functions of
/// rate and angular acceleration, which stay: scales, axes, a mounting and a clock that are wrong.
class GyroExcess {
 public:
  struct Frame {
    SeenTurn turn;
    double lasting = 0.0;                           ///< its variance by what other frames share [rad^2/s^2]
    Eigen::Vector3d b_g = Eigen::Vector3d::Zero();  ///< the state's [rad/s]
    double time_offset = 0.0;                       ///< the state's, of the cameras [s]
  };
  /// `P`: of the state's error.
  void add(const Frame& frame, const Covariance& P);

  /// By how much faster the images turn than the gyroscope by a constant [rad/s]: so much the state's bias is too
  /// large.
  struct Bias {
    Eigen::Vector3d value = Eigen::Vector3d::Zero();
    double variance = 0.0;  ///< one axis, what the state does not know not included
  };
  [[nodiscard]] Bias bias() const { return {x_.row(0).transpose(), P_(0, 0) + lasting_}; }

  /// By how much the state's bias is off [rad/s], about the axis where it is least likely; 0 where noise or what the
  /// state does not know of it may explain that, and without a frame since it was asked.
  double take(const Covariance& P);

 private:
  using Vector7 = Eigen::Matrix<double, 7, 1>;

  /// What a constant, the rate and the angular acceleration add to each axis, and their covariance, the same for all
  /// axes.
  Eigen::Matrix<double, 7, 3> x_ = Eigen::Matrix<double, 7, 3>::Zero();
  Eigen::Matrix<double, 7, 7> P_ = Eigen::Matrix<double, 7, 7>::Zero();
  double lasting_ = 0.0;                                   ///< variance of the bias by what frames share
  NoiseScore unexplained_{kStreamMemory, kClear* kClear};  ///< turns may be less exact than is stated
  Frame last_;
  bool asked_ = true;
};

}  // namespace ear
