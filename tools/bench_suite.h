// The runs of `ear bench --suite`: a vehicle that stands, one that drives and one that flies, simulated and rendered,
// each at 30 and 10 Hz and with several numbers of features.
#pragma once

#include <filesystem>
#include <vector>

#include "ear/config.h"
#include "tools/suite_figures.h"

namespace ear::tools {

struct SuiteOptions {
  std::filesystem::path folder;                ///< of the recordings; empty: a temporary one
  int repeat = 3;                              ///< runs of each
  double seconds = 4.0;                        ///< of each recording that count
  std::vector<int> features = {50, 150, 300};  ///< tracked at a time
};

/// All of them, in rounds, so that what else the machine does falls on all alike. Without `machine`, `commit` and
/// `kernels`. Throws InputError where the folder holds something else.
[[nodiscard]] SuiteFigures run_suite(const Config& config, const SuiteOptions& options);

}  // namespace ear::tools
