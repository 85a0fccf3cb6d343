#include "tools/bench_figures.h"

#include <doctest/doctest.h>

#include <nlohmann/json.hpp>
#include <stdexcept>
#include <vector>

namespace ear::tools {
namespace {

BenchFigures example() {
  BenchFigures figures;
  figures.recording = "drive";
  figures.frames = 360;
  figures.points = 150;
  figures.stages = {{"floor", {4.0, 4.0, 5.0, 6.0, 7.0}},
                    {"pipeline", {2.0, 1.9, 2.5, 3.0, 3.5}},
                    {"track", {0.5, 0.4, 0.6, 0.7, 0.8}}};
  figures.allocations = Distribution{12.0, 11.0, 20.0, 30.0, 40.0};
  figures.ratio = 0.475;
  figures.peak_memory_mb = 55.5;
  return figures;
}

TEST_CASE("bench: quantiles are nearest ranks") {
  std::vector<double> values;
  for (int i = 100; i >= 1; --i) values.push_back(i);
  const Distribution d = distribution_of(values);
  CHECK(d.mean == doctest::Approx(50.5));
  CHECK(d.p50 == 50.0);
  CHECK(d.p95 == 95.0);
  CHECK(d.p99 == 99.0);
  CHECK(d.max == 100.0);
  CHECK(distribution_of({3.0}).p50 == 3.0);
  CHECK(distribution_of({1.0, 2.0, 3.0}).p50 == 2.0);
  CHECK(distribution_of({}).max == 0.0);
}

TEST_CASE("bench: JSON keeps every figure") {
  const nlohmann::json json = to_json(example());
  CHECK(to_json(bench_figures_of(nlohmann::json::parse(json.dump()))) == json);
  BenchFigures uncounted = example();
  uncounted.allocations.reset();
  CHECK_FALSE(bench_figures_of(to_json(uncounted)).allocations);
  CHECK_THROWS_AS(bench_figures_of(nlohmann::json::object()), std::runtime_error);
}

TEST_CASE("bench: the table shows each part's share, the comparison its change") {
  CHECK(table_of(example()).find("25.0 %") != std::string::npos);  // track of the pipeline
  BenchFigures after = example();
  after.stages[1].second.mean = 2.2;
  CHECK(comparison_of(example(), after).find("+10.0 %") != std::string::npos);
  after.recording = "flight";
  CHECK(comparison_of(example(), after).find("different recordings: drive and flight") == 0);
}

}  // namespace
}  // namespace ear::tools
