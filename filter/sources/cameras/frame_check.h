// What a frame shows by itself and against the one before. How exact are its features? In poor light they are less so
// than usual. And do two frames in a row agree with how the vehicle is thought to have moved between them? Unlike the
// filter's gates, which see a feature when its track ends, this shows at once. docs/filter.md, "Poor light";
// docs/health.md.
#pragma once

#include <vector>

#include "ear/types.h"
#include "filter/ekf/gate.h"
#include "filter/ekf/state.h"
#include "filter/sources/cameras/frame_agreement.h"
#include "filter/sources/cameras/stereo_motion.h"

namespace ear {

class FrameCheck {
 public:
  /// `sigma_px`: of one observation, as it usually is. `focal_px`: pixels per unit of normalized image coordinates.
  FrameCheck(double sigma_px, double focal_px);

  /// A new frame, of two cameras. What both see must lie on a line, wherever the point and the vehicle are: how far it
  /// does not is noise, but for what is common to all features, an error of the calibration. Few features tell nothing.
  void measure_noise(const FeatureFrame& frame, const CameraState& cameras);
  /// Standard deviation of its features, times the usual; 1 or more.
  [[nodiscard]] double noise() const { return noise_; }
  /// Standard deviation of one of its observations, one axis, normalized.
  [[nodiscard]] double sigma() const { return noise_ * sigma_px_ / focal_px_; }

  /// Share of the frame's stereo features that are behind the cameras: most, if left and right were exchanged.
  [[nodiscard]] double share_behind(const FeatureFrame& frame, const CameraState& cameras) const;
  /// `matches`: of the frame before with this one. The motion between them as the filter predicts it, and the standard
  /// deviation of its path [m].
  [[nodiscard]] FrameAgreement compare(const std::vector<StereoMatch>& matches, const Pose& T_B0B1, double sigma_p,
                                       const CameraState& cameras, const Gate& gate) const;

 private:
  double sigma_px_;
  double focal_px_;
  double noise_ = 1.0;
  std::vector<double> distances_;  // memory that is used again
};

}  // namespace ear
