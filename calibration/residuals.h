// What is left of each measurement: for reports.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "calibration/batch.h"

namespace ear::calibration {

/// Measured less predicted.
struct Residual {
  Term kind = Term::pixel;
  std::size_t drive = 0;
  std::size_t sensor = 0;  ///< of pixels the camera, of beams the beam
  double t = 0.0;          ///< since the drive's first keyframe [s]
  Eigen::Vector2d value =
      Eigen::Vector2d::Zero();                   ///< pixels: [px]; rolls: left and right, beams: first only, in sigmas
  Eigen::Vector2d at = Eigen::Vector2d::Zero();  ///< pixels: in the image [px]; beams: where it hits the world [m]
};

/// Of features, rolls, beams and reference positions, at the batch's present values.
[[nodiscard]] std::vector<Residual> residuals_of(const Batch& batch);

}  // namespace ear::calibration
