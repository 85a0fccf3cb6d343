// What became of each number of a calibration, and the refusal of those that were not shown.
#pragma once

#include <Eigen/Core>
#include <functional>
#include <string>
#include <vector>

#include "calibration/parameters.h"

namespace ear::calibration {

/// What became of one number.
struct Finding {
  std::string name;  ///< "encoder0: wheel radius, mean"
  std::string unit;  ///< of all that follows
  double given = 0.0;
  double change = 0.0;         ///< calibrated less given; 0 where the given value stays
  double prior = 0.0;          ///< standard deviation before
  double posterior = 0.0;      ///< standard deviation after
  bool shown = true;           ///< false: the drives did not show it, and the given value stays
  std::string entangled_with;  ///< the entry of the largest correlation
  double correlation = 0.0;    ///< of it
  std::string motion_wanted;   ///< what would show it; empty where it was shown
};

/// Findings, and the covariance that belongs to them, in the units of Parameters.
struct Decided {
  std::vector<Finding> findings;
  Eigen::MatrixXd covariance;
};

/// Of the entries as estimated.
struct Covariances {
  Eigen::MatrixXd found;  ///< by the errors as they are found
  Eigen::MatrixXd white;  ///< (J^T J)^-1, were they white and of the size assumed
};

/// An entry whose standard deviation came to no less than `shown_below` of its prior goes back to the given value, and
/// what hangs on it with it: the entries' values are moved, and as uncertain as that value makes them, which may be
/// more than before. No variance is taken to be less than white errors make it: few of them tell their size badly.
///
/// `motion_wanted`: by the name of an entry, what would show it.
[[nodiscard]] Decided decide(const std::vector<Entry>& entries, const Covariances& covariances, double shown_below,
                             const std::function<std::string(const std::string&)>& motion_wanted);

}  // namespace ear::calibration
