// Errors of the lenses that no state describes stay at their place in the image, and no number of features averages
// them out. They are measured here; what they may do to lengths counts in the estimate's covariance.
// docs/decisions/0040-errors-that-do-not-average.md.
#pragma once

#include <Eigen/Core>
#include <array>

#include "filter/ekf/state.h"

namespace ear {

/// How far the right observation of a feature is off its epipolar line shows nothing of its depth. The mean over a cell
/// of the image, beyond what chance makes of noise, is an error of the lenses there. Along the line it is as large, and
/// makes a wrong depth.
class LensPattern {
 public:
  /// A feature that both cameras saw, normalized coordinates as measured.
  void add(const Eigen::Vector2d& left, const Eigen::Vector2d& right, const CameraState& cameras);
  /// After all features of a frame: older ones count less.
  void forget();
  void reset() { *this = LensPattern(); }

  /// Standard deviation over the cells of the error that stays, normalized; 0 where chance explains the means.
  [[nodiscard]] double sigma() const;
  /// Standard deviation of the scale that all disparities show together, relative: each cell's are wrong alike.
  [[nodiscard]] double scale_sigma() const;

 private:
  struct Cell {
    double count = 0.0, across = 0.0, disparity = 0.0;  ///< sums
  };
  std::array<std::array<Cell, 8>, 6> cells_;
  double count_ = 0.0, across2_ = 0.0, disparity2_ = 0.0;  ///< sums over all cells; of squares
  double added_ = 0.0;                                     ///< features since forget()
};

}  // namespace ear
