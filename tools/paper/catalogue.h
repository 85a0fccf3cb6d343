// What is measured: the paper's tables I to V with their printed figures, a table of all sequences, and the ablation.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "tools/paper/measure/result.h"

namespace ear::paper {

enum class Figure {
  ate,           ///< [m]
  ate_percent,   ///< of the length
  z,             ///< [m]
  rotation,      ///< [deg]
  start_to_end,  ///< error of the last pose [m]
  end_distance,  ///< between the ends of the estimated path [m]
  true_end_distance,
  nees,      ///< of the position
  coverage,  ///< [%]
  frame_ms,
  worst_frame_ms
};

/// Nothing where the run does not have it; a run that did not follow (Result::followed) has its coverage only.
[[nodiscard]] std::optional<double> figure_of(const Result& result, Figure figure);

/// One sequence at one camera rate with one configuration: what all seeds of a cell have in common.
struct Setup {
  std::string sequence;
  double camera_rate_hz = 30.0;
  std::string configuration;
};
[[nodiscard]] bool operator==(const Setup& a, const Setup& b);

/// A cell of ours. Several setups: the ratio of each to the same of `against`, and the geometric mean of these.
struct Cell {
  std::vector<Setup> setups;
  Figure figure = Figure::ate;
  std::string against;  ///< a configuration; empty: the figure itself
};

struct Row {
  std::string label;
  std::vector<std::string> printed;  ///< in the paper, as texts: "-" where it says that the method failed
  std::vector<Cell> ours;
};

struct TableDefinition {
  std::string id;     ///< "I"
  std::string title;  ///< for people
  std::string text;   ///< what must be known to read it
  std::vector<std::string> printed_columns;
  std::vector<std::string> our_columns;
  std::vector<Row> rows;
};

/// The fifteen recordings of the paper, by the simulator's names.
[[nodiscard]] const std::vector<std::string>& paper_sequences();

/// Tables I to V and "all", for those of `sequences` only.
[[nodiscard]] std::vector<TableDefinition> paper_tables(const std::vector<std::string>& sequences);

/// One table of each ingredient left out, by camera rate, and one per rate with all sequences. Some
/// ingredients can be measured on feature tracks only.
[[nodiscard]] std::vector<TableDefinition> ablation_tables(const std::vector<std::string>& sequences, bool tracks);

/// All setups that the tables need, each once.
[[nodiscard]] std::vector<Setup> setups_of(const std::vector<TableDefinition>& tables);

}  // namespace ear::paper
