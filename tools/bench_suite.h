// The runs of `ear bench --suite`: a vehicle that stands, one that drives and one that flies, simulated and rendered,
// each at 30 and 10 Hz and with several numbers of features.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "ear/config.h"
#include "tools/suite_figures.h"

namespace ear::tools {

/// Names of the recordings that there are.
[[nodiscard]] std::vector<std::string> suite_recordings();

struct SuiteOptions {
  std::filesystem::path folder;  ///< of the recordings; empty: a temporary one
  std::vector<std::string> recordings = suite_recordings();
  std::vector<double> rates_hz = {30.0, 10.0};  ///< of the camera
  int repeat = 3;                               ///< runs of each
  double seconds = 4.0;                         ///< of each recording that count
  std::vector<int> features = {50, 150, 300};   ///< tracked at a time
};

/// All of them, in rounds, so that what else the machine does falls on all alike. Without `machine`, `commit` and
/// `kernels`. Throws std::invalid_argument for a recording that there is not, InputError where the folder holds
/// something else.
[[nodiscard]] SuiteFigures run_suite(const Config& config, const SuiteOptions& options);

}  // namespace ear::tools
