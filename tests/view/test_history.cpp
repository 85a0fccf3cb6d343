// What the view keeps: bounded, numbered without gaps, the whole way in few points.
#include <doctest/doctest.h>

#include <nlohmann/json.hpp>
#include <string>

#include "src/jpeg.h"
#include "src/view/history.h"
#include "src/view/moment_text.h"

using namespace ear;
using namespace ear::view;

namespace {

Entry entry(std::size_t bytes = 10) {
  Entry e;
  e.summary = std::make_shared<const std::string>("\"x\":1");
  e.features = std::make_shared<const std::string>("[]");
  e.image = std::make_shared<const std::string>(bytes, 'j');
  return e;
}

}  // namespace

TEST_CASE("history: moments are numbered from 1, and asked for after a number") {
  History history;
  CHECK(history.summaries_after(0) == "[]");
  for (int i = 0; i < 250; ++i) history.add(entry(), std::nullopt);
  const auto first = nlohmann::json::parse(history.summaries_after(0));
  REQUIRE(first.size() == History::kMostPerAnswer);
  CHECK(first.front()["n"] == 1);
  CHECK(first.back()["n"] == 100);
  CHECK(nlohmann::json::parse(history.summaries_after(240)).size() == 10);
  CHECK(history.summaries_after(250) == "[]");
  CHECK(history.summaries_after(~0ULL >> 4U) == "[]");
  CHECK(history.find(250).has_value());
  CHECK_FALSE(history.find(0).has_value());
  CHECK_FALSE(history.find(251).has_value());
}

TEST_CASE("history: five minutes and no more bytes than allowed") {
  History history;
  for (std::size_t i = 0; i < History::kMostEntries + 500; ++i) history.add(entry(), std::nullopt);
  CHECK_FALSE(history.find(500).has_value());
  CHECK(history.find(501).has_value());
  CHECK(nlohmann::json::parse(history.summaries_after(3)).front()["n"] == 501);

  History large;
  constexpr std::size_t kImage = 1'000'000;
  for (int i = 0; i < 200; ++i) large.add(entry(kImage), std::nullopt);
  CHECK(large.bytes() <= History::kMostBytes);
  CHECK(large.bytes() > History::kMostBytes - 2 * kImage);
  CHECK(large.find(200).has_value());
  CHECK_FALSE(large.find(100).has_value());
}

TEST_CASE("history: the whole way stays within a number of points, in order, from the first one") {
  Path path;
  for (int i = 0; i < 100'000; ++i) path.add({{static_cast<double>(i), 0.0, 0.0}, std::nullopt});
  REQUIRE(path.points().size() < Path::kMostPoints);
  REQUIRE(path.points().size() > Path::kMostPoints / 4);
  CHECK(path.points().front().estimate.x() == 0.0);
  CHECK(path.points().back().estimate.x() > 99'000.0);
  for (std::size_t i = 1; i < path.points().size(); ++i) {
    REQUIRE(path.points()[i].estimate.x() > path.points()[i - 1].estimate.x());
  }
}

TEST_CASE("features: what the filter made of each stands before its place, and those that ended are marked") {
  CameraCalibration camera;
  camera.width = 640;
  camera.height = 480;
  camera.fu = camera.fv = 400.0;
  camera.cu = 320.0;
  camera.cv = 240.0;
  const Lens lens(camera);
  Moment moment;
  moment.features = {{5, {0.0, 0.0}, {-0.05, 0.0}, 12, true, FeatureUse::used, false},
                     {6, {0.1, 0.1}, {0.0, 0.0}, 3, false, FeatureUse::refused, true}};
  CHECK(nlohmann::json::parse(features_text(moment, &lens, &lens)) ==
        nlohmann::json::parse("[[5,12,1,320.0,240.0,300.0,240.0],[6,3,6,360.0,280.0]]"));
}

TEST_CASE("moment: numbers that are none become null, and a moment without an estimate has no state") {
  Moment moment;
  moment.ranges = {0.3, std::numeric_limits<double>::quiet_NaN()};
  const auto lost = nlohmann::json::parse("{" + summary_text(moment) + "}");
  CHECK(lost["ranges"][1].is_null());
  CHECK_FALSE(lost.contains("state"));
  CHECK(lost["status"] == "initialising");
  moment.estimate.emplace();
  moment.estimate->covariance.setIdentity();
  moment.estimate->state.t_ns = 1'700'000'000'123'456'789;
  moment.estimate->state.p_WB = {1.23456789, -2.0, std::numeric_limits<double>::infinity()};
  const auto there = nlohmann::json::parse("{" + summary_text(moment) + "}");
  CHECK(there["t_ns"] == "1700000000123456789");  // more digits than a number of JavaScript has
  CHECK(there["state"]["p"][0] == 1.234568);
  CHECK(there["state"]["p"][2].is_null());
}

TEST_CASE("image: smaller than asked for, and a part of a larger one is what is seen") {
  std::vector<std::uint8_t> pixels(1000 * 100, 200);
  CHECK(jpeg({}, 480).empty());
  const std::string small = jpeg({pixels.data(), 640, 100, 1000}, 480);
  REQUIRE(small.size() > 100);
  CHECK(small.substr(0, 2) == "\xff\xd8");
}
