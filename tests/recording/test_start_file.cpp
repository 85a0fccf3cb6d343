#include "src/recording/start_file.h"

#include <doctest/doctest.h>

#include <sstream>
#include <string>

#include "tests/recording/support.h"

using namespace ear;
using namespace ear::test;

namespace {

const std::string kStart =
    "t_ns: 1500\nposition: [1, 2, 3]\nrotation: [0.7071, 0, 0, 0.7071]  # w, x, y, z\nvelocity: [0.1, 0.2, 0.3]\n";

GivenStart load(const std::string& text) {
  const TempFolder folder;
  write_text(folder / "start.yaml", text);
  return load_start(folder / "start.yaml", TimeSpan{1000, 2000});
}

std::string error_of(const std::string& text) {
  return input_error_of([&] { (void)load(text); });
}

std::string with(const std::string& key, const std::string& value) {
  std::string text;
  std::istringstream lines(kStart);
  for (std::string line; std::getline(lines, line);) text += line.rfind(key + ":", 0) == 0 ? "" : line + "\n";
  return value.empty() ? text : text + key + ": " + value + "\n";
}

}  // namespace

TEST_CASE("start file: what it must say, and what it may") {
  const GivenStart start = load(kStart);
  CHECK(start.state.t_ns == 1500);
  CHECK(start.state.p_WB == Eigen::Vector3d(1.0, 2.0, 3.0));

  CHECK((start.state.q_WB * Eigen::Vector3d::UnitX()).isApprox(Eigen::Vector3d::UnitY(), 1e-4));
  CHECK(start.state.v_W == Eigen::Vector3d(0.1, 0.2, 0.3));
  CHECK(start.state.b_g.isZero());
  CHECK(start.tilt_sigma == GivenStart{}.tilt_sigma);
  CHECK_FALSE(start.gyro_bias_sigma);

  const GivenStart all = load(kStart +
                              "gyroscope_bias: [0.01, 0.02, 0.03]\naccelerometer_bias: [0.1, 0.2, 0.3]\n"
                              "tilt_sigma: 0.03\nyaw_sigma: 0.04\nposition_sigma: 0.5\nvelocity_sigma: 0.6\n"
                              "gyroscope_bias_sigma: 0.007\naccelerometer_bias_sigma: 0.08\n");
  CHECK(all.state.b_g == Eigen::Vector3d(0.01, 0.02, 0.03));
  CHECK(all.state.b_a == Eigen::Vector3d(0.1, 0.2, 0.3));
  CHECK(all.tilt_sigma == 0.03);
  CHECK(all.yaw_sigma == 0.04);
  CHECK(all.position_sigma == 0.5);
  CHECK(all.velocity_sigma == 0.6);
  CHECK(all.gyro_bias_sigma == 0.007);
  CHECK(all.accel_bias_sigma == 0.08);
}

TEST_CASE("start file: errors name file, line and key") {
  CHECK(contains(error_of(with("t_ns", "2001")), "start.yaml:4: t_ns: the recording goes from 1000 to 2000"));
  CHECK(contains(error_of(with("t_ns", "15.5")), "t_ns: '15.5' is not a whole number"));
  CHECK(contains(error_of(with("rotation", "[1, 1, 0, 0]")), "start.yaml:4: rotation: a quaternion w, x, y, z"));
  CHECK(contains(error_of(with("rotation", "[0, 0, 0, 0]")), "rotation: a quaternion w, x, y, z of length one"));
  CHECK(contains(error_of(with("velocity", "[.nan, 0, 0]")), "start.yaml:4: velocity: '.nan' is not a finite number"));
  CHECK(contains(error_of(with("position", "[1, 2]")), "position: 2 numbers, not 3"));
  CHECK(contains(error_of(with("velocity", "")), "velocity: missing"));
  CHECK(contains(error_of(kStart + "yaw: 0\n"), "start.yaml:5: yaw: there is no such setting"));
  CHECK(contains(error_of(kStart + "tilt_sigma: 0\n"), "start.yaml:5: tilt_sigma: '0' is not positive"));
  CHECK(contains(error_of(kStart + "yaw_sigma: -1\n"), "start.yaml:5: yaw_sigma: "));
}
