// The residual of one observation of one feature by one camera: (1)'s r_c. The model is the filter's.
#pragma once

#include <ceres/sized_cost_function.h>

#include "filter/sources/cameras/triangulation.h"
#include "smoother/blocks.h"

namespace ear::smoother {

/// An observation by camera 0 or 1 in normalized coordinates, and how the body moved when the frame was taken: where it
/// was depends on the time offset.
struct Observation {
  Eigen::Vector2d uv = Eigen::Vector2d::Zero();
  double sigma = 1.0;                                ///< of each coordinate, normalized
  Eigen::Vector3d rate_B = Eigen::Vector3d::Zero();  ///< [rad/s]
  Eigen::Vector3d v_B = Eigen::Vector3d::Zero();     ///< [m/s]
  double time_offset = 0.0;                          ///< [s] that the pose's time was computed with
};

/// Blocks: pose, camera, [stereo,] imaging, point; measured less predicted, whitened.
class LeftFactor final : public ceres::SizedCostFunction<2, 7, 7, 7, 3> {
 public:
  /// `anchor`: the frame of the point block, whose own bearing and depth are not used.
  LeftFactor(const Observation& seen, const InverseDepthPoint& anchor) : seen_(seen), anchor_(anchor) {}
  bool Evaluate(double const* const* blocks, double* residual, double** jacobians) const override;

 private:
  Observation seen_;
  InverseDepthPoint anchor_;
};

class RightFactor final : public ceres::SizedCostFunction<2, 7, 7, 7, 7, 3> {
 public:
  RightFactor(const Observation& seen, const InverseDepthPoint& anchor) : seen_(seen), anchor_(anchor) {}
  bool Evaluate(double const* const* blocks, double* residual, double** jacobians) const override;

 private:
  Observation seen_;
  InverseDepthPoint anchor_;
};

/// The point with the values of its block.
[[nodiscard]] InverseDepthPoint with_values(const InverseDepthPoint& anchor, const double* point);
[[nodiscard]] PointBlock to_block(const InverseDepthPoint& point);

}  // namespace ear::smoother
