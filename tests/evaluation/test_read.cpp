#include <doctest/doctest.h>

#include <stdexcept>

#include "tests/evaluation/support.h"
#include "tools/evaluation/read.h"

namespace ear::evaluation {
namespace {

const std::string kEurocHeader = "#timestamp [ns],p_x [m],p_y,p_z,q_w,q_x,q_y,q_z\n";

/// What reading this file complains about; empty: nothing.
std::string complaint(const std::string& name, const std::string& content) {
  const TemporaryFolder folder("complaint");
  const std::string path = folder.write(name, content).string();
  try {
    (void)read_estimate(path);
  } catch (const std::runtime_error& error) {
    const std::string text = error.what();
    return text.rfind(path, 0) == 0 ? text.substr(path.size()) : text;
  }
  return {};
}

TEST_CASE("read: a TUM time keeps all its nanoseconds, however it is written") {
  const TemporaryFolder folder("tum");
  const auto path = folder.write("a.tum",
                                 "# timestamp tx ty tz qx qy qz qw\n"
                                 "1700000000.000000123 1 2 3 0 0 0.6 0.8\n"
                                 "1.700000001000000124e9 4 5 6 0 0 0 1\n"
                                 "1700000002.0000001256 4 5 6 0 0 0 1\n");
  const Trajectory poses = read_estimate(path).poses;
  REQUIRE(poses.size() == 3);
  CHECK(poses[0].t_ns == 1'700'000'000'000'000'123);
  CHECK(poses[1].t_ns == 1'700'000'001'000'000'124);
  CHECK(poses[2].t_ns == 1'700'000'002'000'000'126);
  CHECK(poses[0].p_WB == Eigen::Vector3d(1, 2, 3));
  CHECK(poses[0].q_WB.isApprox(Eigen::Quaterniond(0.8, 0, 0, 0.6)));
}

TEST_CASE("read: the truth of a recording, by its folder") {
  const TemporaryFolder folder("recording");
  folder.write("mav0/state_groundtruth_estimate0/data.csv",
               kEurocHeader + "1403715273262142976,1,2,3,0.8,0,0,0.6\r\n1403715273312143104,1,2,3,0.8,0,0,0.6\r\n");
  const Trajectory truth = read_truth(folder / "");
  REQUIRE(truth.size() == 2);
  CHECK(truth[0].t_ns == 1'403'715'273'262'142'976);
  CHECK(truth[1].q_WB.isApprox(Eigen::Quaterniond(0.8, 0, 0, 0.6)));
}

TEST_CASE("read: weights, and the sensor at fault in words") {
  const TemporaryFolder folder("weights");
  const std::string header = "t_ns,p_x,p_y,p_z,q_w,q_x,q_y,q_z,weight_imu,weight_odometer,weight_camera,anomalous\n";
  folder.write("states.csv", header + "100,1,2,3,1,0,0,0,1,0.25,0,2\n200,1,2,3,1,0,0,0,1,1,1,0\n");
  const Estimate estimate = read_estimate(folder / "states.csv");
  CHECK(estimate.anomalous == std::vector<std::string>{"odometer", ""});
  REQUIRE(estimate.weights.size() == 2);
  CHECK(estimate.weights[0].odometer == 0.25);
  CHECK(estimate.weights[0].camera == 0.0);
  folder.write("states.csv", header + "100,1,2,3,1,0,0,0,1,0.25,0,9\n");
  CHECK_THROWS_WITH(static_cast<void>(read_estimate(folder / "states.csv")), doctest::Contains("anomalous"));
}

TEST_CASE("read: a states.csv is read by the names in its header") {
  std::string header = "mode,t_ns,q_w,q_x,q_y,q_z,p_x,p_y,p_z";
  std::string row = "fly,100,1,0,0,0,7,8,9";
  const std::vector<std::string> names{"x", "y", "z", "rx", "ry", "rz"};
  for (std::size_t i = 0; i < 6; ++i) {
    for (std::size_t j = i; j < 6; ++j) {
      header += ",cov_" + names[i] + "_" + names[j];
      row += "," + std::to_string(10 * i + j);
    }
  }
  const TemporaryFolder folder("states");
  folder.write("run/states.csv", header + "\n" + row + "\n");
  folder.write("run/estimate.tum", "broken");
  const Estimate estimate = read_estimate(folder / "run");
  REQUIRE(estimate.poses.size() == 1);
  CHECK(estimate.poses[0].t_ns == 100);
  CHECK(estimate.poses[0].p_WB == Eigen::Vector3d(7, 8, 9));
  CHECK(estimate.mode == std::vector<std::string>{"fly"});
  CHECK(estimate.health.empty());
  REQUIRE(estimate.covariance.size() == 1);
  CHECK(estimate.covariance[0](1, 4) == 14.0);
  CHECK(estimate.covariance[0](4, 1) == 14.0);
  CHECK(estimate.covariance[0](5, 5) == 55.0);
}

TEST_CASE("read: comments around the header are no columns") {
  const TemporaryFolder folder("comments");
  const std::string named = "t_ns,q_w,q_x,q_y,q_z,p_x,p_y,p_z";  // not EuRoC's order: the names count
  const auto position = [&](const std::string& text) {
    return read_estimate(folder.write("a.csv", text)).poses.at(0).p_WB;
  };
  const Eigen::Vector3d expected(7, 8, 9);
  CHECK(position("# made by hand, in a hurry\n" + named + "\n1,1,0,0,0,7,8,9\n") == expected);
  CHECK(position(named + "\n# made by hand, in a hurry\n1,1,0,0,0,7,8,9\n") == expected);
  CHECK(position("#" + named + "\n# units: ns, m\n#\n1,1,0,0,0,7,8,9\n") == expected);
  CHECK(position("# without a header, in EuRoC's order\n1,7,8,9,1,0,0,0\n") == expected);
  CHECK(position("# two comments, of which\n# none, is, a header\n1,7,8,9,1,0,0,0,5,5\n") == expected);
  CHECK(complaint("a.csv", "# made by hand, in a hurry\n#" + named + "\n1,1,0,0,0,7,8\n") ==
        ":3: 7 fields where 8 are expected: the line is torn");
}

TEST_CASE("read: the ground of a states.csv, known or not") {
  const TemporaryFolder folder("ground");
  const std::string columns = "t_ns,p_x,p_y,p_z,q_w,q_x,q_y,q_z,on_ground";
  folder.write("states.csv", columns + ",slope_along,slope_across,sigma_slope_along,sigma_slope_across\n" +
                                 "1,0,0,0,1,0,0,0,1,0.1,-0.2,0.01,0.02\n2,0,0,0,1,0,0,0,0,nan,nan,nan,nan\n"
                                 "3,0,0,0,1,0,0,0,0,,,,\n");
  const std::vector<TerrainEstimate> terrain = read_estimate(folder / "states.csv").terrain;
  REQUIRE(terrain.size() == 3);
  CHECK(terrain[0].on_ground);
  REQUIRE(terrain[0].slope);
  CHECK(terrain[0].slope->along == 0.1);
  CHECK(terrain[0].slope->across == -0.2);
  CHECK(terrain[0].sigma.along == 0.01);
  CHECK(terrain[0].sigma.across == 0.02);
  CHECK_FALSE(terrain[1].on_ground);
  CHECK_FALSE(terrain[1].slope);
  CHECK_FALSE(terrain[2].slope);
  CHECK(complaint("a.csv", columns + "\n1,0,0,0,1,0,0,0,2\n") ==
        ":2: field 'on_ground' (column 9): '2' is neither 0 nor 1");
  CHECK(complaint("a.csv", columns + ",slope_along\n1,0,0,0,1,0,0,0,1,0\n") ==
        ":1: the header has no column 'slope_across'");
}

TEST_CASE("read: what a simulated recording knows of the ground") {
  const TemporaryFolder folder("terrain");
  CHECK(read_terrain(folder / "").empty());
  folder.write("mav0/truth_extra.csv",
               "#timestamp [ns],mode [0 ground 1 air],slope_along [rad],slope_across [rad],slip [m/s]\n"
               "5,0,0.1,0.2,9\n7,1,0.3,0.4,9\n");
  const std::vector<TerrainTruth> terrain = read_terrain(folder / "");
  REQUIRE(terrain.size() == 2);
  CHECK(terrain[0].t_ns == 5);
  CHECK(terrain[0].on_ground);
  CHECK_FALSE(terrain[1].on_ground);
  CHECK(terrain[1].slope.along == 0.3);
  CHECK(terrain[1].slope.across == 0.4);
}

TEST_CASE("read: a run without states.csv has no covariance") {
  const TemporaryFolder folder("plain");
  folder.write("run/estimate.tum", "0.5 1 2 3 0 0 0 1\n");
  const Estimate estimate = read_estimate(folder / "run");
  CHECK(estimate.poses.size() == 1);
  CHECK(estimate.poses[0].t_ns == 500'000'000);
  CHECK(estimate.covariance.empty());
}

TEST_CASE("read: what is wrong is named with file, line and field") {
  CHECK(complaint("a.csv", kEurocHeader + "1,0,0,0,1,0,0,0\n2,0,0,x,1,0,0,0\n") ==
        ":3: field 'p_z' (column 4): 'x' is no number");
  CHECK(complaint("a.csv", kEurocHeader + "1,0,nan,0,1,0,0,0\n") == ":2: field 'p_y' (column 3): 'nan' is not finite");
  CHECK(complaint("a.csv", kEurocHeader + "1,0,0,0,1,0,0,0\n2,0,0\n") ==
        ":3: 3 fields where 8 are expected: the line is torn");
  CHECK(complaint("a.csv", kEurocHeader + "2,0,0,0,1,0,0,0\n2,0,0,0,1,0,0,0\n") ==
        ":3: field 'time' (column 1): not later than the line before");
  CHECK(complaint("a.csv", kEurocHeader + "1,0,0,0,0.5,0,0,0\n") ==
        ":2: field 'q_w' (column 5): quaternion of length 0.500000");
  CHECK(complaint("a.csv", kEurocHeader + "1x,0,0,0,1,0,0,0\n") == ":2: field 'time' (column 1): '1x' is no time");
  CHECK(complaint("a.tum", "99999999999 0 0 0 0 0 0 1\n") ==
        ":1: field 'time' (column 1): '99999999999' is more than 142 years from zero");
  CHECK(complaint("a.csv", kEurocHeader + "9223372036854775807.5,0,0,0,1,0,0,0\n") ==
        ":2: field 'time' (column 1): '9223372036854775807.5' is more than 142 years from zero");
  CHECK(complaint("a.tum", "-9e9 0 0 0 0 0 0 1\n9e9 0 0 0 0 0 0 1\n") ==
        ":1: field 'time' (column 1): '-9e9' is more than 142 years from zero");
  CHECK(complaint("a.tum", "1 0 0 0 0 0 0 1\n\n2 0 0 0 0 0 0\n") ==
        ":3: 7 fields where 8 are expected: the line is torn");
  CHECK(complaint("a.csv", "t_ns,p_x,p_y,p_z,q_w,q_x,q_z\n1,0,0,0,1,0,0\n") == ":1: the header has no column 'q_y'");
  CHECK(complaint("a.csv", "t_ns,p_x,p_y,p_z,q_w,q_x,q_y,q_z,cov_x_x\n1,0,0,0,1,0,0,0,1\n") ==
        ":1: the header has no column 'cov_x_y'");
  CHECK(complaint("a.csv", "1,2,3\n") ==
        ":1: neither TUM (8 columns), nor EuRoC csv (8 or more), nor a csv with a column 't_ns' in its header");
  CHECK(complaint("a.tum", "# nothing\n\n") == ": holds no rows of numbers");
  CHECK_THROWS_WITH((void)read_truth("/nowhere/at/all"), "/nowhere/at/all: does not exist");
  const TemporaryFolder folder("empty");
  CHECK_THROWS_WITH((void)read_estimate(folder / "."),
                    ((folder / ".").string() + ": the folder holds no states.csv or estimate.tum").c_str());
}

TEST_CASE("read: equal stems are told apart by their folders") {
  using Names = std::vector<std::string>;
  CHECK(distinct_names({"x/a.tum", "x/b.tum"}) == Names{"a", "b"});
  CHECK(distinct_names({"x/a/estimate.tum", "x/b/estimate.tum"}) == Names{"a", "b"});
  CHECK(distinct_names({"/1/run/estimate.tum", "/2/run/estimate.tum"}) == Names{"1/run", "2/run"});
  CHECK(distinct_names({"same.tum", "same.tum"}) == Names{"same.tum", "same.tum"});
  const TemporaryFolder folder("names");
  folder.write("a/run/estimate.tum", "");
  folder.write("b/run/estimate.tum", "");
  CHECK(distinct_names({folder / "a/run", folder / "b/run/"}) == Names{"a/run", "b/run"});
}

}  // namespace
}  // namespace ear::evaluation
