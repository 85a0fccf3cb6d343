#include "tools/paper/tables.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <nlohmann/json.hpp>

#include "tools/experiments/statistics.h"

namespace ear::paper {
namespace {

using Json = nlohmann::ordered_json;

Value over_seeds(const std::vector<Result>& results, Figure figure) {
  Value value;
  std::vector<double> figures;
  for (const Result& result : results) {
    ++value.runs;
    value.followed += result.followed() ? 1 : 0;
    if (const std::optional<double> number = figure_of(result, figure)) figures.push_back(*number);
  }
  if (figures.empty() || 2 * figures.size() < results.size()) return value;
  value.median = experiments::median(figures);
  const auto [least, most] = std::minmax_element(figures.begin(), figures.end());
  value.worst = figure == Figure::coverage ? *least : *most;
  return value;
}

/// Geometric mean of the ratios of medians; nothing if one of the setups has none.
Value mean_ratio(const Cell& cell, const Lookup& results) {
  Value value;
  double logs = 0.0;
  bool complete = true;
  for (const Setup& setup : cell.setups) {
    const Value above = over_seeds(results(setup), cell.figure);
    const Value below = over_seeds(results({setup.sequence, setup.camera_rate_hz, cell.against}), cell.figure);
    value.runs += above.runs;
    value.followed += above.followed;
    complete = complete && above.median && below.median;
    if (complete) logs += std::log(*above.median / *below.median);
  }
  if (complete && !cell.setups.empty()) {
    value.median = value.worst = std::exp(logs / static_cast<double>(cell.setups.size()));
  }
  return value;
}

Json optional(const std::optional<double>& value) { return value ? Json(*value) : Json(nullptr); }

std::string line(const std::vector<std::string>& cells) {
  std::string text = "|";
  for (const std::string& cell : cells) text += " " + cell + " |";
  return text + "\n";
}

}  // namespace

std::vector<Table> fill(const std::vector<TableDefinition>& definitions, const Lookup& results) {
  std::vector<Table> tables;
  for (const TableDefinition& definition : definitions) {
    Table table{definition, {}};
    for (const Row& row : definition.rows) {
      std::vector<Value> values;
      for (const Cell& cell : row.ours) {
        values.push_back(cell.against.empty() ? over_seeds(results(cell.setups.front()), cell.figure)
                                              : mean_ratio(cell, results));
      }
      table.values.push_back(values);
    }
    tables.push_back(table);
  }
  return tables;
}

std::string number_text(double value) {
  std::array<char, 32> text{};
  if (value == 0.0) return "0";
  const int decimals = std::clamp(2 - static_cast<int>(std::floor(std::log10(std::abs(value)))), 0, 4);
  std::snprintf(text.data(), text.size(), "%.*f", decimals, value);
  return text.data();
}

std::string text_of(const Value& value) {
  std::string text = value.median ? number_text(*value.median) : "-";
  if (value.median && *value.worst != *value.median) text += " (" + number_text(*value.worst) + ")";
  if (value.followed < value.runs && value.followed > 0) {
    text += ", " + std::to_string(value.followed) + " of " + std::to_string(value.runs);
  }
  return text;
}

std::string to_markdown(const Table& table) {
  const TableDefinition& definition = table.definition;
  std::vector<std::string> head{""};
  head.insert(head.end(), definition.printed_columns.begin(), definition.printed_columns.end());
  head.insert(head.end(), definition.our_columns.begin(), definition.our_columns.end());
  std::string text = "## Table " + definition.id + ". " + definition.title + "\n\n";
  if (!definition.text.empty()) text += definition.text + "\n\n";
  text += line(head) + "|";
  for (std::size_t i = 0; i < head.size(); ++i) text += "---|";
  text += "\n";
  for (std::size_t r = 0; r < definition.rows.size(); ++r) {
    std::vector<std::string> cells{definition.rows[r].label};
    cells.insert(cells.end(), definition.rows[r].printed.begin(), definition.rows[r].printed.end());
    for (const Value& value : table.values[r]) cells.push_back(text_of(value));
    text += line(cells);
  }
  return text;
}

std::string to_json(const std::vector<Table>& tables, const Origin& origin) {
  Json json{{"command", origin.command},     {"on", origin.kind},
            {"seeds", origin.seeds},         {"estimator", origin.estimator},
            {"simulator", origin.simulator}, {"tables", Json::array()}};
  for (const Table& table : tables) {
    const TableDefinition& definition = table.definition;
    Json rows = Json::array();
    for (std::size_t r = 0; r < definition.rows.size(); ++r) {
      Json ours = Json::array();
      for (const Value& value : table.values[r]) {
        ours.push_back({{"median", optional(value.median)},
                        {"worst", optional(value.worst)},
                        {"runs", value.runs},
                        {"followed", value.followed}});
      }
      rows.push_back({{"label", definition.rows[r].label}, {"printed", definition.rows[r].printed}, {"ours", ours}});
    }
    json["tables"].push_back({{"id", definition.id},
                              {"title", definition.title},
                              {"printed_columns", definition.printed_columns},
                              {"our_columns", definition.our_columns},
                              {"rows", rows}});
  }
  return json.dump(2) + "\n";
}

}  // namespace ear::paper
