// Runs of several seeds as one table row each: for people in Markdown, for programs in JSON.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "tools/experiments/figures.h"

namespace ear::experiments {

/// What all seeds of a table row have in common.
struct Setup {
  std::string sequence;
  double camera_rate_hz = 30.0;
  std::string odometer = "none";     ///< what the filter makes of the wheels
  bool true_calibration = true;      ///< the filter is given the true calibration, or a wrong one
  std::string settings = "default";  ///< name of the filter's settings
};

struct Run {
  Setup setup;
  std::uint64_t seed = 0;
  Figures figures;
};

/// One row per setup, in the order of the setups' first runs. Over the seeds: the worst of ATE, the mean of NEES and of
/// what is a share, the median of everything else. Columns that no run has are left out. Ends with a newline.
[[nodiscard]] std::string to_markdown(const std::vector<Run>& runs);

/// All figures of every run. Ends with a newline.
[[nodiscard]] std::string to_json(const std::vector<Run>& runs);

}  // namespace ear::experiments
