#include "tools/suite_figures.h"

#include <doctest/doctest.h>

#include <nlohmann/json.hpp>
#include <stdexcept>
#include <string>
#include <vector>

namespace ear::tools {
namespace {

BenchFigures run(double pipeline_ms) {
  BenchFigures figures;
  figures.recording = "drive";
  figures.frames = 120;
  figures.points = 150;
  figures.stages = {{"floor", {4.0, 4.0, 5.0, 6.0, 7.0}},
                    {"pipeline", {pipeline_ms, pipeline_ms, 2.0 * pipeline_ms, 3.0 * pipeline_ms, 9.0}},
                    {"filter", {0.5, 0.5, 0.6, 0.7, 0.8}},
                    {"samples", {0.1, 0.1, 0.1, 0.1, 0.1}}};
  figures.ratio = pipeline_ms / 4.0;
  return figures;
}

SuiteFigures suite(double pipeline_ms) {
  SuiteFigures figures;
  figures.machine = {"Some CPU", 2, 2500.0, "performance"};
  figures.commit = "abc";
  figures.kernels = "avx2";
  figures.runs = 3;
  figures.cells = {suite_cell(30.0, {run(pipeline_ms), run(1.02 * pipeline_ms), run(0.98 * pipeline_ms)})};
  return figures;
}

TEST_CASE("suite: the median, and half of the range") {
  const Scattered odd = scattered({3.0, 1.0, 2.0});
  CHECK(odd.value == 2.0);
  CHECK(odd.scatter == 1.0);
  CHECK(scattered({1.0, 2.0}).value == 1.5);
  CHECK(scattered({}).value == 0.0);
}

TEST_CASE("suite: a cell has each stage, the slow frames and the ratio") {
  const SuiteCell cell = suite(2.0).cells.front();
  std::vector<std::string> names;
  for (const auto& figure : cell.figures) names.push_back(figure.first);
  CHECK(names == std::vector<std::string>{"floor", "pipeline", "filter", "samples", "p99", "ratio"});
  CHECK(cell.figures[1].second.value == 2.0);
  CHECK(cell.figures[1].second.scatter == doctest::Approx(0.04));
  CHECK(cell.figures[4].second.value == 6.0);
  CHECK(cell.features == 150);
  CHECK(cell.frames == 120);
}

TEST_CASE("suite: JSON keeps every figure") {
  const nlohmann::json json = to_json(suite(2.0));
  CHECK(to_json(suite_figures_of(nlohmann::json::parse(json.dump()))) == json);
  CHECK_THROWS_AS((void)suite_figures_of(nlohmann::json::object()), std::runtime_error);
}

TEST_CASE("suite: the comparison marks what is beyond the scatter") {
  const std::string same = comparison_of(suite(2.0), suite(2.02));
  CHECK(same.find("+1.0 +- 2.9 ") != std::string::npos);
  CHECK(same.find('*', same.find('\n')) == std::string::npos);
  CHECK(comparison_of(suite(2.0), suite(1.0)).find("-50.0 +- 1.4*") != std::string::npos);
  SuiteFigures elsewhere = suite(2.0);
  elsewhere.machine.processor = "Another";
  CHECK(comparison_of(suite(2.0), elsewhere).find("different processors: Some CPU and Another") != std::string::npos);
  elsewhere.cells.front().rate_hz = 10.0;  // what was not measured before is not compared
  CHECK(comparison_of(suite(2.0), elsewhere).find("drive") == std::string::npos);
}

TEST_CASE("suite: the table says on what, and by which program") {
  const std::string table = table_of(suite(2.0));
  CHECK(table.find("Some CPU, 2500 MHz, governor performance; commit abc, kernels avx2; 3 runs") == 0);
  CHECK(table.find("drive      30 Hz  150") != std::string::npos);
  CHECK(table.find("2.000 +-0.040") != std::string::npos);
}

TEST_CASE("bench: the line to paste is a row of a table") {
  CHECK(line_to_paste(run(2.0), {"Some CPU", 2, 2500.4, "unknown"}, "abc", "avx2") ==
        "| Some CPU | 2 | 2500 | unknown | avx2 | drive | 150 | 2.00 | 6.00 | 0.50 | abc |");
}

}  // namespace
}  // namespace ear::tools
