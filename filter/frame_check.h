// Do two frames in a row agree with how the vehicle is thought to have moved between them? Unlike the filter's gates,
// which see a feature when its track ends, this tells at once. docs/health.md.
#pragma once

#include <Eigen/Core>

#include "ear/types.h"
#include "filter/state.h"
#include "filter/stereo_motion.h"

namespace ear {

/// The motion between the frames as the filter predicts it, and how well it knows it.
struct PredictedMotion {
  Eigen::Matrix3d R_B0B1 = Eigen::Matrix3d::Identity();
  Eigen::Vector3d p_B0B1 = Eigen::Vector3d::Zero();  ///< [m]
  double sigma_p = 0.0;                              ///< [m] standard deviation of p_B0B1
};

struct FrameAgreement {
  int matches = 0;            ///< features seen by both cameras in the first frame, by the left one in the second
  double left = 0.0;          ///< share of them that are not where they were expected: left camera
  double right = 0.0;         ///< right camera
  double feigned_turn = 0.0;  ///< [rad/s] so fast the cameras' calibration may make it seem to turn; the filter's
  // What the image tells by itself, whatever came before.
  double noise = 1.0;   ///< of the features, times the usual
  double behind = 0.0;  ///< share of the stereo features that the geometry puts behind the cameras
  bool frozen = false;  ///< the image is exactly the one before
  Eigen::Vector3d turn = Eigen::Vector3d::Zero();  ///< by which the vehicle turned more than predicted [rad], in B
  double turn_sigma = 0.0;                         ///< [rad] its standard deviation, the worst axis; 0: not known
};

/// `sigma`: one observation, normalized. `gate`: of the squared Mahalanobis distance of one observation (2 axes).
class FrameCheck {
 public:
  FrameCheck(double sigma, double gate) : sigma_(sigma), gate_(gate) {}

  /// Share of the frame's stereo features that are behind the cameras: most, if left and right were exchanged.
  /// `noise`: of the features, times the usual.
  [[nodiscard]] double share_behind(const FeatureFrame& frame, const CameraState& cameras, double noise = 1.0) const;

  [[nodiscard]] FrameAgreement compare(const FeatureFrame& from, const FeatureFrame& to, const PredictedMotion& motion,
                                       const CameraState& cameras, double noise = 1.0);

 private:
  double sigma_, gate_;
  StereoMatches matches_;
};

}  // namespace ear
