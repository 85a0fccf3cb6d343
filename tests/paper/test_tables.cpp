#include <doctest/doctest.h>

#include <map>
#include <nlohmann/json.hpp>
#include <string>

#include "tools/paper/tables.h"

using namespace ear::paper;

namespace {

std::vector<Result> runs(const std::vector<double>& ate, double coverage = 1.0) {
  std::vector<Result> results;
  for (const double value : ate) {
    Result result;
    result.estimated = true;
    result.coverage = coverage;
    result.length = 10.0;
    result.ate = value;
    results.push_back(result);
  }
  return results;
}

/// Results by configuration, whatever the sequence.
Table filled(const std::vector<Cell>& cells, const std::map<std::string, std::vector<Result>>& results) {
  TableDefinition definition{"T", "title", "text", {"printed"}, {}, {{"row", {"0.5"}, cells}}};
  for (const Cell& cell : cells) definition.our_columns.push_back(cell.setups.front().configuration);
  return fill({definition},
              [&](const Setup& setup) -> const std::vector<Result>& { return results.at(setup.configuration); })
      .front();
}

Cell ate(const std::string& configuration, const std::string& against = "") {
  return {{{"flat1", 30.0, configuration}}, Figure::ate, against};
}

}  // namespace

TEST_CASE("tables: median and worst of the seeds") {
  const Table table = filled({ate("a")}, {{"a", runs({0.3, 0.1, 0.2})}});
  const Value& value = table.values[0][0];
  CHECK(value.median == 0.2);
  CHECK(value.worst == 0.3);
  CHECK(text_of(value) == "0.200 (0.300)");
}

TEST_CASE("tables: runs that did not follow are counted, and no figure where they are most") {
  std::vector<Result> mixed = runs({0.1, 0.2});
  mixed.push_back(runs({0.0}, 0.1).front());
  const Table table = filled({ate("mixed"), ate("lost"), ate("one")},
                             {{"mixed", mixed}, {"lost", runs({0.1, 0.1}, 0.2)}, {"one", runs({0.1})}});
  CHECK(text_of(table.values[0][0]) == "0.150 (0.200), 2 of 3");
  CHECK(text_of(table.values[0][1]) == "-");
  CHECK(text_of(table.values[0][2]) == "0.100");
}

TEST_CASE("tables: a ratio is the geometric mean of the ratios of medians") {
  Cell cell = ate("b", "a");
  cell.setups.push_back({"wave1", 30.0, "c"});
  const Table table = filled({cell}, {{"a", runs({0.1})}, {"b", runs({0.2})}, {"c", runs({0.8})}});
  CHECK(*table.values[0][0].median == doctest::Approx(4.0));
}

TEST_CASE("tables: three significant digits") {
  CHECK(number_text(0.0) == "0");
  CHECK(number_text(0.01234) == "0.0123");
  CHECK(number_text(1.2345) == "1.23");
  CHECK(number_text(98.76) == "98.8");
  CHECK(number_text(1234.5) == "1234");
}

TEST_CASE("tables: Markdown and JSON say the same") {
  const Table table = filled({ate("a"), ate("lost")}, {{"a", runs({0.3, 0.1, 0.2})}, {"lost", runs({0.1}, 0.2)}});
  const auto json = nlohmann::json::parse(to_json({table}, {"ear experiments", "images", {1, 2, 3}, "e", "s"}));
  CHECK(json["seeds"].size() == 3);
  const auto& row = json["tables"][0]["rows"][0];
  CHECK(row["ours"][0]["median"] == 0.2);
  CHECK(row["ours"][0]["worst"] == 0.3);
  CHECK(row["ours"][1]["median"].is_null());
  CHECK(row["printed"][0] == "0.5");
  const std::string markdown = to_markdown(table);
  CHECK(markdown.find("|  | printed | a | lost |\n|---|---|---|---|\n| row | 0.5 | 0.200 (0.300) | - |\n") !=
        std::string::npos);
}
