#include <doctest/doctest.h>

#include <nlohmann/json.hpp>

#include "tools/experiments/table.h"

namespace ear::experiments {
namespace {

Run run(const std::string& sequence, std::uint64_t seed, std::optional<double> ate, double coverage) {
  Run result;
  result.setup.sequence = sequence;
  result.seed = seed;
  result.figures.ate_rmse = ate;
  result.figures.coverage = coverage;
  return result;
}

const std::vector<Run> kRuns{run("flat1", 1, 0.01, 90.0), run("fly1", 1, std::nullopt, 0.0), run("flat1", 2, 0.5, 96.0),
                             run("flat1", 3, 0.02, 99.0), run("fly1", 2, 1234.5, 50.0)};

TEST_CASE("table: one row per setup; median, worst and mean; columns that nobody has are left out") {
  CHECK(to_markdown(kRuns) ==
        "| sequence | Hz | odometer | calibration | settings | seeds | ATE [m] | worst | coverage [%] |\n"
        "|---|---|---|---|---|---|---|---|---|\n"
        "| flat1 | 30 | none | true | default | 3 | 0.02 | 0.5 | 95 |\n"
        "| fly1 | 30 | none | true | default | 1 of 2 | 1234 | 1234 | 25 |\n");
}

TEST_CASE("table: setups that differ in one thing are different rows") {
  std::vector<Run> runs(5, kRuns[0]);
  runs[1].setup.camera_rate_hz = 10.0;
  runs[2].setup.true_calibration = false;
  runs[3].setup.settings = "other";
  runs[4].setup.odometer = "terrain";
  const std::string text = to_markdown(runs);
  CHECK(text.find("| flat1 | 30 | none | true | default | 1 |") != std::string::npos);
  CHECK(text.find("| flat1 | 10 | none | true | default | 1 |") != std::string::npos);
  CHECK(text.find("| flat1 | 30 | terrain | true | default | 1 |") != std::string::npos);
  CHECK(text.find("| flat1 | 30 | none | true | other | 1 |") != std::string::npos);
  CHECK(text.find("| flat1 | 30 | none | wrong | default | 1 |") != std::string::npos);
}

TEST_CASE("table: JSON holds every run; what is missing is null") {
  const nlohmann::json list = nlohmann::json::parse(to_json(kRuns));
  REQUIRE(list.size() == 5);
  CHECK(list[2]["sequence"] == "flat1");
  CHECK(list[2]["seed"] == 2);
  CHECK(list[2]["ate_rmse_m"] == 0.5);
  CHECK(list[1]["ate_rmse_m"].is_null());
  CHECK(list[1]["slope_along_rmse_deg"].is_null());
}

}  // namespace
}  // namespace ear::experiments
