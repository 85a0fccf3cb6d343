#include "src/live/live_settings.h"

#include <doctest/doctest.h>

#include <fstream>

#include "src/recording/input_error.h"

using namespace ear;
using namespace ear::live;

namespace {

LiveSettings load(const std::string& text) {
  const std::filesystem::path file = std::filesystem::temp_directory_path() / "ear-live-settings.yaml";
  std::ofstream(file) << text;
  return load_live_settings(file);
}

/// The message without the folder.
std::string refusal(const std::string& text) {
  try {
    load(text);
  } catch (const InputError& error) {
    const std::string message = error.what();
    return message.substr(message.rfind('/') + 1);
  }
  return "taken";
}

}  // namespace

TEST_CASE("live settings: every key is read") {
  const LiveSettings settings = load(
      "calibration: vehicle\nbudget_ms: 20\nframe_slots: 6\n"
      "mavlink:\n"
      "  - {address: 'serial:/dev/ttyAMA0:921600', system: 3, mounting_deg: [180, 0, 90], imu: HIGHRES_IMU,\n"
      "     wheels: true, ranges: [2, 0, 1], send: false}\n"
      "cameras: {device: /dev/video0, right: /dev/video2, rate: 60, delay: 0.01}\n"
      "ros: {domain: 5, odometry: /odom, predicted: '', tf: false, base_frame: axle}\n"
      "log: {level: warning, file: live.log, megabytes: 2, older_files: 5}\n");
  CHECK(settings.calibration == std::filesystem::temp_directory_path() / "vehicle");
  CHECK(settings.budget_ms == 20.0);
  CHECK(settings.frame_slots == 6);
  REQUIRE(settings.mavlink.size() == 1);
  const MavlinkSettings& line = settings.mavlink[0];
  CHECK(line.address == "serial:/dev/ttyAMA0:921600");
  CHECK(line.system == 3);
  CHECK_FALSE(line.send);
  CHECK((*line.mounting_deg)[2] == 90.0);
  CHECK(line.inputs.imu == MavlinkInputs::Imu::highres);
  CHECK(line.inputs.wheels);
  CHECK(line.inputs.range_ids == std::vector<int>{2, 0, 1});
  CHECK(settings.cameras->right == "/dev/video2");
  CHECK(settings.cameras->rate_hz == 60.0);
  CHECK(settings.cameras->delay == 0.01);
  CHECK(settings.ros->domain == 5);
  CHECK(settings.ros->names.odometry == "/odom");
  CHECK(settings.ros->names.predicted.empty());
  CHECK(settings.ros->names.base_frame == "axle");
  CHECK_FALSE(settings.ros->names.tf);
  CHECK(settings.log.level == LogLevel::warning);
  CHECK(settings.log.most_bytes == 2'000'000);
  CHECK(settings.log.older_files == 5);
}

TEST_CASE("live settings: mistakes are named with file, line and key") {
  const std::string file = "ear-live-settings.yaml:";
  CHECK(refusal("calibration: a\nbudget: 3\n") == file + "2: budget: there is no such setting");
  CHECK(refusal("mavlink:\n  - address: 'udp:a:1'\n    imu: RAW_IMU\n") ==
        file + "3: mavlink[0].imu: 'RAW_IMU' is none of HIGHRES_IMU, SCALED_IMU, none");
  CHECK(refusal("mavlink:\n  - imu: none\n") == file + "2: mavlink[0].address: missing");
  CHECK(refusal("mavlink:\n  - {address: 'udp:a:1', ranges: [1, 1]}\n") ==
        file + "2: mavlink[0].ranges: different ids from 0 to 255 expected, one for each beam");
  CHECK(refusal("budget_ms: -1\n") == file + "1: budget_ms: must not be negative; 0: no budget");
  CHECK(refusal("ros:\n  domain: 233\n") == file + "2: ros.domain: 0 to 232 expected");
  CHECK(refusal("topics: {imu: /imu}\n") == file + "1: topics: without `ros`, which reads them");
  CHECK(refusal("cameras: {device: /dev/video0, rate: 0}\n") == file + "1: cameras.rate: 0 to 1000 Hz expected");
}

TEST_CASE("live settings: the budget is most of the time between two frames") {
  Calibration calibration;
  CHECK(default_budget_ms(calibration) == 0.0);
  calibration.cameras.resize(1);
  calibration.cameras[0].rate_hz = 20.0;
  CHECK(default_budget_ms(calibration) == doctest::Approx(35.0));
}
