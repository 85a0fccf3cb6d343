// Are the images of left and right exchanged? From the images alone, before there is an estimate.
//
// A point at inverse depth rho of one camera is seen by the other one at R x + rho p, and rho >= 0 of whatever is in
// front of them: on one half of the epipolar line, which begins at R x. Each corner of the left image is searched in
// the right one twice: as if the images were of the cameras that they are said to be of, and as if they were exchanged.
// For two equal, parallel cameras the halves are the two sides of u_left: the disparity is d = u_left - u_right = f b
// rho >= 0, and -d with the images exchanged, as if the point were behind the cameras. A match is right to a pixel, so
// that one of more than 3 pixels from R x distinguishes the halves, and what is farther than f b / 3 shows nothing.
//
// Wrong matches fall on both halves alike. If at most a fifth of the matches is on the wrong one, each match multiplies
// the odds of the half that it is on by 0.8 / 0.2 = 4 at least; ten more on one than on the other make them 4^10, a
// million to one (Wald's sequential test). One repeated pattern can deceive many matches of one pair at once: a pair
// counts as four at most, so that it takes three of them.
#pragma once

#include "ear/calibration.h"
#include "ear/types.h"

namespace ear {

class SwappedCameras {
 public:
  enum class Verdict { open, right, swapped };

  SwappedCameras(const CameraCalibration& left, const CameraCalibration& right) : left_(left), right_(right) {}

  /// Matches one pair, of the calibration's size; some milliseconds. Nothing is done once there is a verdict.
  void add(const ImageView& left, const ImageView& right);

  [[nodiscard]] Verdict verdict() const { return verdict_; }
  /// Matches so far that show it: that fit the cameras as they are said to be, and exchanged.
  [[nodiscard]] int as_stated() const { return as_stated_; }
  [[nodiscard]] int exchanged() const { return exchanged_; }

 private:
  CameraCalibration left_, right_;
  int as_stated_ = 0, exchanged_ = 0;
  int balance_ = 0;  ///< their difference, each pair's within bounds
  Verdict verdict_ = Verdict::open;
};

}  // namespace ear
