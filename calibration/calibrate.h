// From drives to a calibration, and to words about what they did not show.
#pragma once

#include <Eigen/Core>
#include <functional>
#include <string>
#include <vector>

#include "calibration/batch.h"
#include "calibration/findings.h"
#include "calibration/residuals.h"

namespace ear::calibration {

struct Result {
  Calibration calibration;  ///< with the standard deviations stated
  Parameters parameters;
  std::vector<Finding> findings;  ///< in the order of blocks_of()
  Eigen::MatrixXd covariance;     ///< in the units of Parameters
  Noise noise;
  std::vector<Residual> before, after;  ///< by the calibration given, and by that found
  double left_out = 0.0;                ///< [s] of the drives, where there was no estimate in one piece
};

struct Settings {
  FilterConfig filter;    ///< of the first guess
  double interval = 0.2;  ///< [s] between keyframes
  Noise noise;
  int threads = 2;
  int rounds = 3;  ///< solutions, each with the noise by the one before; fewer: a preview
  /// What the drives must have brought a standard deviation down to, of its prior, for a value to be changed.
  double shown_below = 0.7;
  std::function<void(const std::string&)> progress;  ///< may be empty
};

/// Throws std::invalid_argument where the drives cannot be used, std::runtime_error where no minimum is found.
[[nodiscard]] Result calibrate(const Calibration& given, const Priors& priors, const std::vector<Drive>& drives,
                               const Settings& settings);

}  // namespace ear::calibration
