#include <doctest/doctest.h>

#include <algorithm>
#include <string>

#include "tools/paper/catalogue.h"
#include "tools/paper/measure/configuration.h"
#include "tools/simulator/sequence.h"

using namespace ear::paper;

namespace {

void check_shape(const std::vector<TableDefinition>& tables) {
  for (const TableDefinition& table : tables) {
    CAPTURE(table.id);
    for (const Row& row : table.rows) {
      CAPTURE(row.label);
      CHECK(row.printed.size() == table.printed_columns.size());
      CHECK(row.ours.size() == table.our_columns.size());
    }
  }
}

const TableDefinition& find(const std::vector<TableDefinition>& tables, const std::string& id) {
  return *std::find_if(tables.begin(), tables.end(), [&](const TableDefinition& table) { return table.id == id; });
}

}  // namespace

TEST_CASE("catalogue: every row has a cell for every column, every setup exists") {
  check_shape(paper_tables(paper_sequences()));
  check_shape(ablation_tables({"flat1", "fly1"}, false));
  CHECK(ablation_tables({"flat1"}, true).front().rows.size() == ablation().size() - 1);
  CHECK(ablation_tables({"flat1"}, false).front().rows.size() == ablation().size() - 2);
  for (const Setup& setup : setups_of(paper_tables(paper_sequences()))) {
    CHECK_NOTHROW(static_cast<void>(find_configuration(setup.configuration)));
    CHECK_NOTHROW(static_cast<void>(ear::simulator::find_sequence(setup.sequence)));
  }
}

TEST_CASE("catalogue: the tables have the paper's rows") {
  const auto tables = paper_tables(paper_sequences());
  CHECK(paper_sequences().size() == 15);
  CHECK(find(tables, "I").rows.size() == 10);
  CHECK(find(tables, "II").rows.size() == 16);
  CHECK(find(tables, "III").rows.size() == 5);
  CHECK(find(tables, "IV").rows.size() == 3);
  CHECK(find(tables, "V").rows.size() == 6);
  CHECK(find(tables, "III").rows.back().ours.back().setups.front().camera_rate_hz == 5.0);
}

TEST_CASE("catalogue: of some sequences only their rows, and no empty table") {
  const auto tables = paper_tables({"sway3"});
  REQUIRE(tables.size() == 3);  // all, IV, V
  CHECK(find(tables, "IV").rows.size() == 1);
  for (const Setup& setup : setups_of(tables)) CHECK(setup.sequence == "sway3");
}

TEST_CASE("catalogue: a run that did not follow has its coverage and no other figure") {
  Result result;
  result.estimated = true;
  result.ate = 0.1;
  result.length = 20.0;
  result.coverage = 0.2;
  CHECK(figure_of(result, Figure::coverage) == doctest::Approx(20.0));
  CHECK_FALSE(figure_of(result, Figure::ate));
  result.coverage = 0.9;
  CHECK(figure_of(result, Figure::ate) == doctest::Approx(0.1));
  CHECK(figure_of(result, Figure::ate_percent) == doctest::Approx(0.5));
  result.length = 0.8;
  CHECK_FALSE(figure_of(result, Figure::ate_percent));
}
