// What `ear bench` found out, as numbers, as text and as JSON.
#pragma once

#include <cstddef>
#include <cstdint>
#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <string>
#include <utility>
#include <vector>

namespace ear::tools {

/// One value per frame.
struct Distribution {
  double mean = 0.0, p50 = 0.0, p95 = 0.0, p99 = 0.0, max = 0.0;
};

/// Nearest rank: the smallest value that at least the share of all values does not exceed. All zero if there is none.
[[nodiscard]] Distribution distribution_of(std::vector<double> values);

struct BenchFigures {
  std::string recording;
  std::size_t frames = 0;                                    ///< measured, warm-up left out
  int points = 0;                                            ///< features kept at a time
  std::vector<std::pair<std::string, Distribution>> stages;  ///< [ms per frame], in the order of the table
  std::optional<Distribution> allocations;                   ///< per frame; nothing where they cannot be counted
  double peak_memory_mb = 0.0;                               ///< resident, reader and decoder included
  double ratio = 0.0;                                        ///< median of the pipeline to that of the floor

  /// Throws std::invalid_argument if there is no such stage.
  [[nodiscard]] const Distribution& stage(const std::string& name) const;
};

[[nodiscard]] nlohmann::json to_json(const BenchFigures& figures);

/// Throws std::runtime_error if it is not what to_json() makes.
[[nodiscard]] BenchFigures bench_figures_of(const nlohmann::json& json);

[[nodiscard]] std::string table_of(const BenchFigures& figures);

/// What changed from one to the other, stage by stage.
[[nodiscard]] std::string comparison_of(const BenchFigures& before, const BenchFigures& after);

}  // namespace ear::tools
