#include <doctest/doctest.h>

#include <nlohmann/json.hpp>

#include "src/recording/csv.h"
#include "src/recording/writers.h"
#include "tests/recording/support.h"

using namespace ear;
using namespace ear::test;

namespace {

// Every number differs, so that a column in the wrong place shows.
Estimate numbered_estimate() {
  Estimate e;
  e.state.t_ns = 1403715273262142976;
  e.state.p_WB << 1, 2, 3;
  e.state.q_WB = Eigen::Quaterniond(0.5, -0.5, 0.5, -0.5);
  e.state.v_W << 4, 5, 6;
  e.state.b_g << 7, 8, 9;
  e.state.b_a << 10, 11, 12;
  for (int i = 0; i < estimate_error::size; ++i) {
    for (int j = 0; j < estimate_error::size; ++j) e.covariance(i, j) = 100 * std::min(i, j) + std::max(i, j);
  }
  e.frame = {60, 61, 62, 63, 64, 65, 66, 67, 68, true, true};
  e.terrain = {true, 0.6, 0.7, 0.8, 0.9};
  e.consistency = {{true, true, true}, {0.01, 0.02, 0.03}, {1.0, 0.25, 1.0}, 4e-4, 0.02, 0.01, MotionSensor::odometer};
  e.health.quality = 75;
  e.health.load_step = 2;
  e.health.sources[index_of(Source::wheel_right)].score = 0.125;
  return e;
}

}  // namespace

TEST_CASE("tum: nanoseconds survive, quaternion with w last") {
  const TempFolder folder;
  {
    TumWriter writer(folder / "a.tum");
    writer.write(numbered_estimate());
    NavState early;
    early.t_ns = 5;
    writer.write(early);
    early.t_ns = -1'000'000'005;
    writer.write(early);
  }
  const std::string text = read_text(folder / "a.tum");
  CHECK(contains(text,
                 "1403715273.262142976 1.000000000 2.000000000 3.000000000 -0.500000000 0.500000000 -0.500000000 "
                 "0.500000000\n"));
  CHECK(contains(text, "\n0.000000005 0.000000000 0.000000000 0.000000000 0.000000000 0.000000000 0.000000000 1.0"));
  CHECK(contains(text, "\n-1.000000005 0"));
}

TEST_CASE("states: every value stands below its name") {
  const TempFolder folder;
  StatesWriter(folder / "states.csv").write(numbered_estimate(), "degraded: without a, b");
  std::ifstream file(folder / "states.csv");
  std::string heading;
  std::string values;
  std::getline(file, heading);
  std::getline(file, values);

  std::map<std::string, std::string> row;
  std::istringstream names(heading);
  std::istringstream fields(values);
  std::string name;
  std::string field;
  while (std::getline(names, name, ',')) {
    REQUIRE(std::getline(fields, field, ','));
    CHECK(row.emplace(name, field).second);
  }
  CHECK_FALSE(std::getline(fields, field, ','));

  CHECK(row.size() == 1 + 3 + 4 + 9 + 21 + 9 + 11 + 4 + 9 + 4 + 9);
  CHECK(row["t_ns"] == "1403715273262142976");
  CHECK(row["p_z"] == "3");
  CHECK(row["q_w"] == "0.5");
  CHECK(row["q_x"] == "-0.5");
  CHECK(row["v_y"] == "5");
  CHECK(row["b_g_x"] == "7");
  CHECK(row["b_a_z"] == "12");
  CHECK(row["cov_x_x"] == "606");  // position is 6 to 8 in the covariance, rotation 0 to 2
  CHECK(row["cov_x_y"] == "607");
  CHECK(row["cov_z_rx"] == "8");
  CHECK(row["cov_rx_rz"] == "2");
  CHECK(row["cov_rz_rz"] == "202");
  CHECK(std::stod(row["sigma_v_x"]) == doctest::Approx(std::sqrt(303.0)));
  CHECK(std::stod(row["sigma_b_g_y"]) == doctest::Approx(std::sqrt(1010.0)));
  CHECK(std::stod(row["sigma_b_a_z"]) == doctest::Approx(std::sqrt(1414.0)));
  CHECK(row["tracks"] == "60");
  CHECK(row["clones"] == "64");
  CHECK(row["wheel_rows_rejected"] == "66");
  CHECK(row["beams_used"] == "67");
  CHECK(row["standing"] == "1");
  CHECK(row["on_ground"] == "1");
  CHECK(row["slope_across"] == "0.7");
  CHECK(row["sigma_slope_along"] == "0.8");
  CHECK(row["weight_odometer"] == "0.25");
  CHECK(row["inconsistency_camera"] == "0.03");
  CHECK(row["displacement_variance"] == "0.0004");
  CHECK(row["disagreement"] == "2");
  CHECK(row["anomalous"] == "2");
  CHECK(row["mode"] == "standing");
  CHECK(row["health"] == "degraded: without a; b");
  CHECK(row["quality"] == "75");
  CHECK(row["load_step"] == "2");
  CHECK(row["score_wheel_left"] == "1");
  CHECK(row["score_wheel_right"] == "0.125");
}

TEST_CASE("summary: valid JSON with all that was said") {
  const TempFolder folder;
  RunSummary summary;
  summary.recording = "path with \"quotes\"";
  summary.counts = {{"frames", 7}, {"estimates", 6}};
  summary.duration_s = 1.5;
  summary.stage_times_s = {{"update", 0.25}};
  summary.health = {{17, "tracking"}};
  summary.warnings = {{"imu0: torn last line", 1, "data.csv:9: line: 3 fields, not 7"}};
  write_summary(summary, folder / "summary.json");
  const auto json = nlohmann::json::parse(read_text(folder / "summary.json"));
  CHECK(json["recording"] == summary.recording);
  CHECK(json["health"][0]["t_ns"] == 17);
  CHECK(json["health"][0]["is"] == "tracking");
  CHECK(json["counts"]["estimates"] == 6);
  CHECK(json["duration_s"] == 1.5);
  CHECK(json["stage_times_s"]["update"] == 0.25);
  CHECK(json["warnings"][0]["count"] == 1);
  CHECK(json["warnings"][0]["first"] == summary.warnings[0].first);
}

TEST_CASE("summary: all that online calibration moves") {
  const TempFolder folder;
  const auto written = [&](const Calibration& calibration) {
    RunSummary summary;
    summary.calibration = calibration;
    write_summary(summary, folder / "summary.json");
    return nlohmann::json::parse(read_text(folder / "summary.json"))["calibration"];
  };
  CHECK(written({}).empty());

  Calibration learned;
  learned.cameras.resize(2);
  learned.cameras[0].T_BC.translation() << 0.1, 0.05, 0.0;
  learned.cameras[0].T_BC.linear() << 0, 0, 1, -1, 0, 0, 0, -1, 0;
  learned.cameras[1].T_BC = learned.cameras[0].T_BC * Eigen::Translation3d(0.08, 0.01, 0.02);
  learned.camera_time_offset = 0.004;
  learned.cameras[1].fu = 386.0;
  learned.cameras[1].cv = 239.0;
  learned.encoder = EncoderCalibration{};
  learned.encoder->T_BO.translation() << 0.0, 0.0, -0.05;
  learned.encoder->wheel_radius = {0.0751, 0.0749};
  learned.lasers = LaserCalibration{};
  learned.lasers->beams = {{"rear", {0.1, 0.0, -0.02}, {0.6, 0.0, -0.8}}};
  const auto json = written(learned);
  const auto pose = [&](const char* name) { return json[name].get<std::vector<double>>(); };
  CHECK(pose("T_BC0") == std::vector<double>{0, 0, 1, 0.1, -1, 0, 0, 0.05, 0, -1, 0, 0, 0, 0, 0, 1});
  REQUIRE(pose("T_C0C1").size() == 16);
  CHECK(pose("T_C0C1")[3] == doctest::Approx(0.08));
  CHECK(pose("T_C0C1")[11] == doctest::Approx(0.02));
  CHECK(pose("T_BC1")[3] == doctest::Approx(0.12));
  CHECK(pose("T_BO")[11] == -0.05);
  CHECK(json["camera_time_offset"] == 0.004);
  CHECK(json["intrinsics_1"][0] == 386.0);
  CHECK(json["intrinsics_1"][3] == 239.0);
  CHECK(json["wheel_radius_right"] == 0.0749);
  CHECK(json["track_width"] == 0.4);
  CHECK(json["beams"][0]["name"] == "rear");
  CHECK(json["beams"][0]["origin"] == std::vector<double>{0.1, 0.0, -0.02});
}

TEST_CASE("writers: a file that cannot be created is an error that names it") {
  const TempFolder folder;
  CHECK(contains(input_error_of([&] { TumWriter(folder / "no/such/folder/a.tum"); }), "a.tum"));
}
