// Do two frames in a row agree with how the vehicle is thought to have moved between them? Unlike the filter's gates,
// which see a feature when its track ends, this shows at once. docs/health.md.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "ear/types.h"
#include "filter/ekf/gate.h"
#include "filter/ekf/state.h"
#include "filter/sources/cameras/frame_agreement.h"
#include "filter/sources/cameras/stereo_motion.h"

namespace ear {

/// The motion between the frames as the filter predicts it, and how well it knows it.
struct PredictedMotion {
  Eigen::Matrix3d R_B0B1 = Eigen::Matrix3d::Identity();
  Eigen::Vector3d p_B0B1 = Eigen::Vector3d::Zero();  ///< [m]
  double sigma_p = 0.0;                              ///< [m] standard deviation of p_B0B1
};

/// `sigma`: one observation, normalized.
class FrameCheck {
 public:
  FrameCheck(double sigma, const Gate& gate) : sigma_(sigma), gate_(gate) {}

  /// Share of the frame's stereo features that are behind the cameras: most, if left and right were exchanged.
  /// `noise`: of the features, times the usual.
  [[nodiscard]] double share_behind(const FeatureFrame& frame, const CameraState& cameras, double noise = 1.0) const;

  /// `matches`: of the frame before with this one.
  [[nodiscard]] FrameAgreement compare(const std::vector<StereoMatch>& matches, const PredictedMotion& motion,
                                       const CameraState& cameras, double noise = 1.0) const;

 private:
  double sigma_;
  Gate gate_;
};

}  // namespace ear
