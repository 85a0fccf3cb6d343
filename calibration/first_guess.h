// How the vehicle moved, before the calibration is known: by the filter, with the calibration at hand and all its
// uncertainty.
#pragma once

#include <vector>

#include "calibration/drive.h"
#include "ear/calibration.h"
#include "ear/filter_config.h"

namespace ear::calibration {

/// A state that the filter estimated, and the image that was taken then.
struct GuessedState {
  NavState state;
  TimeNs stamp_ns = 0;                       ///< of the image, by the camera's clock
  std::vector<FeatureObservation> features;  ///< by the lens of the calibration given; empty without an image
};

struct FirstGuess {
  std::vector<GuessedState> states;  ///< without gaps
  double left_out = 0.0;             ///< [s] of the drive, where there was no estimate, or none in one piece
};

/// `given`: whose lens the features were seen through; `now`: the calibration at hand, its standard deviations stated.
/// From the cameras alone where there are any, for wheels and beams that are not yet calibrated would mislead it.
/// The accelerometer is exact, as the batch takes it to be: what the filter learned of its matrix the batch would have
/// to find in the biases. States are `interval` seconds apart. Throws std::invalid_argument, naming the drive, where
/// hardly anything is estimated.
[[nodiscard]] FirstGuess guess_motion(const Drive& drive, const Calibration& given, Calibration now,
                                      FilterConfig config, double interval);

}  // namespace ear::calibration
