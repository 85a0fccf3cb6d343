// How a vehicle with cameras moves during its start: the moments of its frames by the inertial samples, what their
// noise adds up to, and where a point is seen. For image_start.h.
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <vector>

#include "ear/calibration.h"
#include "ear/types.h"
#include "filter/ekf/state.h"
#include "filter/ingest/imu_buffer.h"
#include "filter/start/start_fit.h"
#include "filter/start/start_sums.h"

namespace ear {

/// A frame of the fit.
struct StartMoment {
  static constexpr int errors = 6;  ///< turn [rad] and position [m] by the noise of the inertial samples
  /// Of all moments before this one; the first has none.
  [[nodiscard]] static Eigen::Index errors_before(std::size_t moment) {
    return errors * static_cast<Eigen::Index>(moment - 1);
  }

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

/// Covariance of the errors of turn [rad] and position [m], e_k, of all frames but the first, where they are zero. For
/// frames at `times`, oldest first, by the noise of the samples and the biases of x.
[[nodiscard]] Eigen::MatrixXd path_noise(const std::vector<TimeNs>& times, const StartFit::Vector& x,
                                         const ImuBuffer& imu, const ImuCalibration& noise);

/// Where a camera sees a point, normalized, and the derivatives.
struct PointImage {
  double depth = 0.0;  ///< of the point times its inverse depth; the rest is for those before the camera
  Eigen::Vector2d uv;
  Eigen::Matrix<double, 2, 3> by_point;
  Eigen::Matrix<double, 2, StartFit::size> by_state;
  Eigen::Matrix<double, 2, 3> by_turn, by_position;  ///< of the body, in B
};
/// `point`: its direction (alpha, beta, 1) and its inverse depth [1/m] in the left camera at the first moment, as
/// (alpha, beta, inverse depth). `cameras`: as calibrated, without what x has of it; `camera`: 0 left, 1 right.
[[nodiscard]] PointImage image_of(const Eigen::Vector3d& point, const StartFit::Vector& x, const StartMoment& moment,
                                  const CameraState& cameras, int camera);

}  // namespace ear
