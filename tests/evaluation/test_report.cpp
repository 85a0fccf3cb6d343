#include <doctest/doctest.h>

#include <algorithm>
#include <limits>
#include <nlohmann/json.hpp>

#include "tests/evaluation/support.h"
#include "tools/evaluation/plot.h"
#include "tools/evaluation/report.h"
#include "tools/evaluation/summary.h"

namespace ear::evaluation {
namespace {

bool contains(const std::string& text, const std::string& part) { return text.find(part) != std::string::npos; }

std::size_t count(const std::string& text, const std::string& part) {
  std::size_t result = 0;
  for (std::size_t at = text.find(part); at != std::string::npos; at = text.find(part, at + 1)) ++result;
  return result;
}

ReportEntry entry(const std::string& name, const Trajectory& truth, double rate, double duration) {
  ReportEntry result;
  result.estimate.name = name;
  result.estimate.poses = moved(isometry({0, 0, 1}, {1, 2, 3}), walk(duration, rate));
  std::mt19937_64 rng{51};
  for (Pose& pose : result.estimate.poses) pose.p_WB += gaussian(rng, 0.01);
  result.estimate.covariance.assign(result.estimate.poses.size(), 1e-4 * PoseCovariance::Identity());
  result.evaluation = evaluate(result.estimate, truth, AlignmentKind::yaw);
  return result;
}

TEST_CASE("ticks are round numbers inside the range") {
  CHECK(ticks({0.0, 10.0}, 5) == std::vector<double>{0, 2, 4, 6, 8, 10});
  CHECK(ticks({-0.9, 2.2}, 3) == std::vector<double>{0, 2});
  const std::vector<double> small = ticks({1.01, 1.049}, 4);
  REQUIRE(small.size() == 4);
  CHECK(small.front() == doctest::Approx(1.01));
  CHECK(small.back() == doctest::Approx(1.04));
}

TEST_CASE("range: ignores what is not finite, is never empty") {
  const Range range = range_of({1.0, std::nan(""), 3.0, INFINITY});
  CHECK(range.first == doctest::Approx(0.9));
  CHECK(range.second == doctest::Approx(3.1));
  CHECK(range_of({2.0}).first < range_of({2.0}).second);
  CHECK(range_of({}).first < range_of({}).second);
}

TEST_CASE("plot: thinning keeps the single peak among many points") {
  Plot plot;
  plot.x_range = {0.0, 100'000.0};
  plot.y_range = {0.0, 1.0};
  Curve curve{"e0", "c", {}};
  for (int i = 0; i < 100'000; ++i) curve.points.emplace_back(i, i == 54'321 ? 1.0 : 0.1 + 0.01 * (i % 7));
  plot.curves.push_back(curve);
  const std::string svg = to_svg(plot);
  CHECK(svg.size() < 40'000);
  CHECK(contains(svg, ",8 "));  // the top of the panel, where 1 lies
}

TEST_CASE("plot: a point that is not finite interrupts the curve") {
  Plot plot;
  plot.curves.push_back({"e0", "c", {{0, 0}, {0.2, 0}, {std::nan(""), 0}, {0.5, 0.5}, {1, 1}}, {}});
  CHECK(count(to_svg(plot), "<polyline") == 2);
}

TEST_CASE("report: stands alone, names everything, escapes what it is given") {
  const Trajectory truth = walk(30.0, 50.0);
  std::vector<ReportEntry> entries{entry("a<b&c", truth, 10.0, 30.0), entry("second", truth, 10.0, 20.0)};
  entries[0].estimate.mode.assign(entries[0].estimate.poses.size(), "drive");
  std::fill(entries[0].estimate.mode.begin() + 100, entries[0].estimate.mode.begin() + 150, "fly");
  const std::string page = to_html("a \"title\"", truth, entries);
  CHECK(contains(page, "a &quot;title&quot;"));
  CHECK(contains(page, "a&lt;b&amp;c"));
  CHECK_FALSE(contains(page, "a<b"));
  CHECK_FALSE(contains(page, "http"));
  CHECK_FALSE(contains(page, "src="));
  CHECK_FALSE(contains(page, "nan,"));
  CHECK_FALSE(contains(page, "inf"));
  for (const std::string title : {"Figures", "Trajectory", "Position error", "Rotation error", "Consistency", "Drift"})
    CHECK(contains(page, "<h2>" + title + "</h2>"));
  CHECK(count(page, "class=\"strip") == 1);
  CHECK(count(page, "<title>drive</title>") == 2);
  CHECK(count(page, "<title>fly</title>") == 1);
  CHECK(count(page, "class=\"band") == 12);  // three axes of position and of rotation, two estimates
}

TEST_CASE("report: who is at fault and the weight of each sensor, of the estimates that have it") {
  const Trajectory truth = walk(30.0, 50.0);
  std::vector<ReportEntry> entries{entry("with", truth, 10.0, 30.0), entry("without", truth, 10.0, 20.0)};
  const std::size_t poses = entries[0].estimate.poses.size();
  entries[0].estimate.anomalous.assign(poses, "");
  std::fill(entries[0].estimate.anomalous.begin() + 50, entries[0].estimate.anomalous.begin() + 60, "odometer");
  std::fill(entries[0].estimate.anomalous.begin() + 70, entries[0].estimate.anomalous.begin() + 80, "odometer");
  const std::string before = to_html("t", truth, entries);
  CHECK(count(before, "class=\"strip") == 1);
  CHECK(count(before, "<title>odometer</title>") == 2);
  CHECK_FALSE(contains(before, "weight: IMU"));

  entries[0].estimate.weights.assign(poses, {1.0, 0.5, 1.0});
  const std::string after = to_html("t", truth, entries);
  CHECK(contains(after, "weight: IMU"));
  CHECK(count(after, "<polyline") == count(before, "<polyline") + 3);
}

TEST_CASE("report: without covariance no bounds and no consistency") {
  const Trajectory truth = walk(30.0, 50.0);
  ReportEntry plain = entry("plain", truth, 10.0, 30.0);
  plain.estimate.covariance.clear();
  plain.evaluation = evaluate(plain.estimate, truth, AlignmentKind::yaw);
  const std::string page = to_html("plain", truth, {plain});
  CHECK_FALSE(contains(page, "<h2>Consistency</h2>"));
  CHECK_FALSE(contains(page, "class=\"band"));
}

TEST_CASE("report: a ten-minute recording, eight noisy estimates, stays below 2.5 MB") {
  const Trajectory truth = walk(600.0, 200.0);
  std::vector<ReportEntry> entries;
  for (const std::string name : {"a", "b", "c", "d", "e", "f", "g", "h"})
    entries.push_back(entry(name, truth, 30.0, 600.0));
  CHECK(to_html("long", truth, entries).size() < 2'500'000);
}

TEST_CASE("table and JSON hold the same figures") {
  const Trajectory truth = walk(30.0, 50.0);
  const Evaluation a = entry("first", truth, 10.0, 30.0).evaluation;
  const Evaluation b = entry("second", truth, 10.0, 40.0).evaluation;  // 10 s longer than the truth
  const std::string table = to_table({a, b});
  const nlohmann::json json = nlohmann::json::parse(to_json({a, b}, "the truth"));
  CHECK(json["truth"] == "the truth");
  CHECK(json["align"] == "yaw");
  REQUIRE(json["estimates"].size() == 2);
  CHECK(json["estimates"][0]["name"] == "first");
  CHECK(json["estimates"][0]["ate_rmse_m"] == a.position_rmse);
  CHECK(json["estimates"][1]["outside_truth"] == 100);
  CHECK(contains(table, "alignment: yaw"));
  CHECK(contains(table, "second: 100 of 401 poses before or after the truth are not counted"));
  for (const SummaryRow& row : summary_rows({a, b})) CHECK(contains(table, value_text(row, 1)));
  CHECK(value_text({"x", {std::nullopt}, 3, false}, 0) == "-");
}

}  // namespace
}  // namespace ear::evaluation
