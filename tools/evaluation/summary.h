// The figures of several evaluations as text: one table for people, one JSON for programs.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "tools/evaluation/evaluate.h"

namespace ear::evaluation {

inline constexpr double kDegPerRad = 57.29577951308232;

/// "se3", "yaw" or "none".
[[nodiscard]] std::string to_string(AlignmentKind kind);

/// One figure of all evaluations. A value is missing where an evaluation does not have it.
struct SummaryRow {
  std::string label;  ///< with its unit
  std::vector<std::optional<double>> values;
  int decimals = 3;
  bool less_is_better = false;
};

/// All figures that a reader compares, in the units of their labels.
[[nodiscard]] std::vector<SummaryRow> summary_rows(const std::vector<Evaluation>& evaluations);

/// A value of a row as text; "-" where it is missing.
[[nodiscard]] std::string value_text(const SummaryRow& row, std::size_t evaluation);

/// What a reader must know to trust the figures: poses without truth, a rotation that came from attitudes.
[[nodiscard]] std::vector<std::string> notes(const std::vector<Evaluation>& evaluations);

/// A table for a terminal, one column per evaluation, with the notes below it. Ends with a newline.
[[nodiscard]] std::string to_table(const std::vector<Evaluation>& evaluations);

/// The same figures and more, as JSON. Ends with a newline.
[[nodiscard]] std::string to_json(const std::vector<Evaluation>& evaluations, const std::string& truth);

}  // namespace ear::evaluation
