// One observation of one feature by one camera, in pixels, so that the lens can be estimated. The geometry is the
// smoother's: smoother/feature_factor.h.
#pragma once

#include <ceres/sized_cost_function.h>

#include "calibration/lens.h"
#include "filter/sources/cameras/triangulation.h"
#include "smoother/blocks.h"

namespace ear::calibration {

/// What was seen, and how the body moved then.
struct PixelObservation {
  Eigen::Vector2d px = Eigen::Vector2d::Zero();      ///< [px]
  double sigma = 1.0;                                ///< of each coordinate [px]
  double late = 0.0;                                 ///< [s] from the pose's time to stamp plus the given time offset
  Eigen::Vector3d rate_B = Eigen::Vector3d::Zero();  ///< [rad/s]
  Eigen::Vector3d v_B = Eigen::Vector3d::Zero();     ///< [m/s]
};

/// The cameras as they were given, which the blocks are errors of.
struct GivenCameras {
  CameraState poses;  ///< its time offset is not used
  std::array<CameraCalibration, 2> lens;
};

/// Blocks: pose, camera, lens of camera 0, time, point. Measured less predicted, over sigma.
class LeftPixel final : public ceres::SizedCostFunction<2, 7, 6, 5, 1, 3> {
 public:
  /// `given` and `anchor` must outlive it.
  LeftPixel(const PixelObservation& seen, const GivenCameras& given, const InverseDepthPoint& anchor)
      : seen_(seen), given_(given), anchor_(anchor) {}
  bool Evaluate(double const* const* blocks, double* residual, double** jacobians) const override;

 private:
  PixelObservation seen_;
  const GivenCameras& given_;
  const InverseDepthPoint& anchor_;
};

/// Blocks: pose, camera, stereo, lens of camera 1, time, point.
class RightPixel final : public ceres::SizedCostFunction<2, 7, 6, 6, 5, 1, 3> {
 public:
  RightPixel(const PixelObservation& seen, const GivenCameras& given, const InverseDepthPoint& anchor)
      : seen_(seen), given_(given), anchor_(anchor) {}
  bool Evaluate(double const* const* blocks, double* residual, double** jacobians) const override;

 private:
  PixelObservation seen_;
  const GivenCameras& given_;
  const InverseDepthPoint& anchor_;
};

/// A pose of `given` with a block's error.
[[nodiscard]] Pose with_error(const Pose& given, const double* error);

}  // namespace ear::calibration
