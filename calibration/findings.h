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

/// An entry whose standard deviation came to no less than `shown_below` of its prior goes back to the given value, and
/// what hangs on it with it: the entries' values are moved. So does one that hangs on such values by so much. `P`:
/// covariance of the entries as estimated; `motion_wanted`: by the name of an entry, what would show it.
[[nodiscard]] Decided decide(const std::vector<Entry>& entries, const Eigen::MatrixXd& P, double shown_below,
                             const std::function<std::string(const std::string&)>& motion_wanted);

}  // namespace ear::calibration
