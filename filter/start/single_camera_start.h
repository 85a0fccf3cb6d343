// Where a filter may begin in a vehicle that moves and has one camera: velocity, gravity and biases that explain how
// the images move, where nothing but the accelerometer shows a length. docs/filter.md, "Starts".
#pragma once

#include <optional>
#include <vector>

#include "ear/calibration.h"
#include "ear/health.h"
#include "filter/ekf/state.h"
#include "filter/ingest/imu_buffer.h"
#include "filter/start/start_fit.h"
#include "filter/start/start_sums.h"

namespace ear {

/// What the camera saw at a time of the IMU's clock.
struct SeenFrame {
  TimeNs t_ns = 0;
  const FeatureFrame* features = nullptr;
};

/// What is known of the sensors: `feature_sigma` of one observation, normalized.
struct StartNoise {
  PriorConfig prior;
  ImuCalibration imu;
  double feature_sigma = 0.0;
};

/// A state at the first of the frames. Least squares (Gauss-Newton, Huber) over the velocity v and gravity g of that
/// moment, in the body as it then was (B), the biases, the camera's turn and time offset, the points seen, and what the
/// noise of the inertial samples adds up to, e, in each moment's turn and position:
///   p_k = v t_k + g t_k^2 / 2 + double integral of R f + e_k
/// That noise is measured, too, by how far e is from zero, as a factor on what is stated.
/// It is a point to linearize at, not an estimate: the frames may be used again. It lacks few_frames, or
/// cameras_contradict where the images do not fit, or moves_unseen where they do not show the length of the path.
[[nodiscard]] StartAttempt single_camera_start(const std::vector<SeenFrame>& frames, const ImuBuffer& imu,
                                               const CameraState& camera, const StartNoise& noise);

/// Covariance of the errors of turn [rad] and position [m], e_k, of all frames but the first, where they are zero. For
/// frames at `times`, oldest first, by the noise of the samples and the biases of x.
[[nodiscard]] Eigen::MatrixXd path_noise(const std::vector<TimeNs>& times, const StartFit::Vector& x,
                                         const ImuBuffer& imu, const ImuCalibration& noise);

/// A frame of the fit.
struct StartMoment {
  static constexpr int errors = 6;  ///< turn [rad] and position [m] by the noise of the inertial samples

  double t = 0.0;  ///< [s] since the first
  StartSums sums;  ///< with the biases of the fit's state
  /// Derivatives of the sums by the time offset, which shifts this moment and the first: of the turn in B [rad/s], and
  /// of the position [m/s].
  Eigen::Vector3d turn_by_offset = Eigen::Vector3d::Zero();
  Eigen::Vector3d position_by_offset = Eigen::Vector3d::Zero();
  Eigen::Vector3d error = Eigen::Vector3d::Zero();  ///< e [m]

  /// Of the body in B, with the state x [m].
  [[nodiscard]] Eigen::Vector3d position(const StartFit::Vector& x) const;
  /// Its derivatives.
  [[nodiscard]] StartFit::Rows position_by_state() const;
};

/// The frames at `times`, oldest first, with the biases and the time offset of x.
[[nodiscard]] std::vector<StartMoment> start_moments(const std::vector<TimeNs>& times, const StartFit::Vector& x,
                                                     const ImuBuffer& imu);

/// Where the camera sees a point, normalized, and the derivatives.
struct PointImage {
  double depth = 0.0;  ///< of the point times its inverse depth; the rest is for those before the camera
  Eigen::Vector2d uv;
  Eigen::Matrix<double, 2, 3> by_point;
  Eigen::Matrix<double, 2, StartFit::size> by_state;
  Eigen::Matrix<double, 2, 3> by_turn, by_position;  ///< of the body, in B
};
/// `point`: its direction (alpha, beta, 1) and its inverse depth [1/m] in the camera at the first moment, as (alpha,
/// beta, inverse depth). `T_BC`: as calibrated, without what x has of it.
[[nodiscard]] PointImage image_of(const Eigen::Vector3d& point, const StartFit::Vector& x, const StartMoment& moment,
                                  const Pose& T_BC);

}  // namespace ear
