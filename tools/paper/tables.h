// The tables with figures in them, as Markdown and JSON.
#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "tools/paper/catalogue.h"

namespace ear::paper {

/// A cell of ours over all seeds.
struct Value {
  std::optional<double> median;  ///< of the runs that have the figure; nothing if fewer than half do
  std::optional<double> worst;   ///< of them: the largest, of the coverage the smallest
  std::size_t runs = 0;
  std::size_t followed = 0;  ///< runs with an estimate for most of the time
};

struct Table {
  TableDefinition definition;
  std::vector<std::vector<Value>> values;  ///< by row and column
};

/// Results of a setup, one per seed.
using Lookup = std::function<const std::vector<Result>&(const Setup&)>;

[[nodiscard]] std::vector<Table> fill(const std::vector<TableDefinition>& definitions, const Lookup& results);

/// Three significant digits: "0.0123".
[[nodiscard]] std::string number_text(double value);

/// "0.0123 (0.0150)": median, and the worst of several; "-" where fewer than half of the runs followed.
[[nodiscard]] std::string text_of(const Value& value);

/// Heading, text and table.
[[nodiscard]] std::string to_markdown(const Table& table);

/// What made the figures: how, with which seeds, from which sources.
struct Origin {
  std::string command;
  std::string kind;  ///< "images" or "tracks"
  std::vector<std::uint64_t> seeds;
  std::string estimator, simulator;  ///< hashes of the sources
};

/// All tables.
[[nodiscard]] std::string to_json(const std::vector<Table>& tables, const Origin& origin);

}  // namespace ear::paper
