#include <doctest/doctest.h>

#include <algorithm>
#include <string>
#include <vector>

#include "tests/evaluation/support.h"
#include "tools/evaluation/moments.h"
#include "tools/evaluation/report.h"

namespace ear::evaluation {
namespace {

constexpr std::size_t kRate = 10;  // [1/s]

/// Half a minute that says how it moves and how it is.
Estimate spoken(double duration = 30.0) {
  Estimate estimate;
  estimate.name = "spoken";
  estimate.poses = walk(duration, static_cast<double>(kRate));
  estimate.mode.assign(estimate.poses.size(), "rolling");
  estimate.health.assign(estimate.poses.size(), "tracking");
  estimate.anomalous.assign(estimate.poses.size(), "");
  return estimate;
}

void set(std::vector<std::string>& labels, std::size_t from, std::size_t to, const std::string& text) {
  std::fill(labels.begin() + static_cast<std::ptrdiff_t>(from * kRate),
            labels.begin() + static_cast<std::ptrdiff_t>(to * kRate), text);
}

std::vector<std::string> words(const std::vector<Moment>& moments) {
  std::vector<std::string> result;
  for (const Moment& moment : moments) result.push_back(moment.words);
  return result;
}

double seconds(const Moment& moment) { return seconds_between(kStart, moment.t_ns); }

TEST_CASE("moments: take-off, landing, faults and what is at fault, in the order of time") {
  Estimate estimate = spoken();
  set(estimate.mode, 10, 20, "free");
  set(estimate.health, 12, 14, "degraded: without camera_left; carried by wheels");
  set(estimate.health, 14, 15, "degraded: without camera_left; carried by inertia alone");
  set(estimate.anomalous, 22, 23, "odometer");
  const std::vector<Moment> moments = moments_of(estimate);
  CHECK(words(moments) == std::vector<std::string>{"start", "take-off", "degraded: without camera_left", "landing",
                                                   "at fault: odometer", "end"});
  REQUIRE(moments.size() == 6);
  CHECK(seconds(moments[1]) == doctest::Approx(10.0));
  CHECK(seconds(moments[3]) == doctest::Approx(20.0));
}

TEST_CASE("moments: where there is no estimate for half a second it was lost, and what is a gap less is not") {
  Estimate estimate = spoken();
  const auto cut = [&](std::size_t from, std::size_t to) {
    for (auto* labels : {&estimate.mode, &estimate.health, &estimate.anomalous})
      labels->erase(labels->begin() + static_cast<std::ptrdiff_t>(from),
                    labels->begin() + static_cast<std::ptrdiff_t>(to));
    estimate.poses.erase(estimate.poses.begin() + static_cast<std::ptrdiff_t>(from),
                         estimate.poses.begin() + static_cast<std::ptrdiff_t>(to));
  };
  cut(200, 203);
  cut(100, 120);
  const std::vector<Moment> moments = moments_of(estimate);
  CHECK(words(moments) == std::vector<std::string>{"start", "lost: no estimate for 2.1 s", "found again", "end"});
  CHECK(seconds(moments[1]) == doctest::Approx(9.9));
}

TEST_CASE("moments: what recurs is there once, and a vehicle without wheels does not take off") {
  Estimate bouncing = spoken();
  for (std::size_t t = 10; t < 14; t += 2) set(bouncing.mode, t, t + 1, "free");
  CHECK(words(moments_of(bouncing)) == std::vector<std::string>{"start", "take-off", "landing", "end"});
  Estimate held = spoken();
  held.mode.assign(held.mode.size(), "free");
  set(held.mode, 0, 3, "standing");
  CHECK(words(moments_of(held)) == std::vector<std::string>{"start", "end"});
  Estimate silent = spoken();
  silent.mode.clear();
  silent.health.clear();
  silent.anomalous.clear();
  CHECK(words(moments_of(silent)) == std::vector<std::string>{"start", "end"});
}

TEST_CASE("moments: where there are too many, losses stay before faults, and these before landings") {
  std::vector<Moment> many;
  for (int i = 0; i < 30; ++i) many.push_back({kStart + i * kSecond, MomentKind::landing, "landing"});
  many.push_back({kStart + 40 * kSecond, MomentKind::lost, "lost"});
  many.push_back({kStart + 31 * kSecond, MomentKind::fault, "fault"});
  const std::vector<Moment> few = foremost(many, 3);
  CHECK(words(few) == std::vector<std::string>{"landing", "fault", "lost"});
  CHECK(foremost(many, 100).size() == many.size());
}

TEST_CASE("report: moments with their images, in one file, and the paths to turn") {
  const Trajectory truth = walk(30.0, 50.0);
  ReportEntry entry{spoken(), {}};
  set(entry.estimate.mode, 10, 20, "free");
  entry.evaluation = evaluate(entry.estimate, truth, AlignmentKind::yaw);
  std::vector<Moment> moments{{kStart + kSecond, MomentKind::take_off, "take-off <1>", "M"},
                              {kStart + 2 * kSecond, MomentKind::fault, "fault", "Ma"},
                              {kStart + 3 * kSecond, MomentKind::lost, "lost", "Man"},
                              {kStart + 4 * kSecond, MomentKind::end, "end"}};
  moments.push_back({kStart + 5 * kSecond, MomentKind::end, "bytes", std::string("\xff\xd8\x00\xfb", 4)});
  const auto contains = [page = to_html("title", truth, {entry}, moments)](const std::string& part) {
    return page.find(part) != std::string::npos;
  };
  CHECK(contains("<h2>In perspective</h2>"));
  CHECK(contains("<h2>Moments</h2>"));
  CHECK(contains("alt=\"left camera: take-off &lt;1&gt;\" src=\"data:image/jpeg;base64,TQ==\""));
  CHECK(contains("src=\"data:image/jpeg;base64,TWE=\""));
  CHECK(contains("src=\"data:image/jpeg;base64,TWFu\""));
  CHECK(contains("src=\"data:image/jpeg;base64,/9gA+w==\""));
  CHECK(contains("<li><b>4.0 s</b> end</li>"));
  CHECK(contains(",1]"));  // in the air
  CHECK_FALSE(contains("http"));
  CHECK(to_html("title", truth, {entry}).find("<h2>Moments</h2>") == std::string::npos);
}

}  // namespace
}  // namespace ear::evaluation
