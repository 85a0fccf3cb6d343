// What `ear bench --suite` found out, as numbers, as text and as JSON.
#pragma once

#include <nlohmann/json_fwd.hpp>
#include <string>
#include <utility>
#include <vector>

#include "tools/bench_figures.h"
#include "tools/machine.h"

namespace ear::tools {

/// A figure over several runs.
struct Scattered {
  double value = 0.0;    ///< their median
  double scatter = 0.0;  ///< half of the difference between largest and smallest
};

/// Nothing at all: zero.
[[nodiscard]] Scattered scattered(std::vector<double> values);

/// One recording at one rate of the camera with one number of features.
struct SuiteCell {
  std::string recording;
  double rate_hz = 0.0;
  int features = 0;
  std::size_t frames = 0;  ///< that count, of one run
  /// [ms per frame], means of the stages in the order of `ear bench`; p99 of the pipeline; its ratio to the floor [1].
  std::vector<std::pair<std::string, Scattered>> figures;
};

struct SuiteFigures {
  Machine machine;
  std::string commit, kernels;
  int runs = 0;
  std::vector<SuiteCell> cells;
};

/// Of runs that measured the same. `rate_hz`: of the camera.
[[nodiscard]] SuiteCell suite_cell(double rate_hz, const std::vector<BenchFigures>& runs);

[[nodiscard]] nlohmann::json to_json(const SuiteFigures& figures);
/// Throws std::runtime_error if it is not what to_json() makes.
[[nodiscard]] SuiteFigures suite_figures_of(const nlohmann::json& json);

[[nodiscard]] std::string table_of(const SuiteFigures& figures);
/// What changed [%], and by how much it may have by chance; a change beyond that has a mark.
[[nodiscard]] std::string comparison_of(const SuiteFigures& before, const SuiteFigures& after);

/// A row of the table in docs/performance.md.
[[nodiscard]] std::string line_to_paste(const BenchFigures& figures, const Machine& machine, const std::string& commit,
                                        const std::string& kernels);

}  // namespace ear::tools
