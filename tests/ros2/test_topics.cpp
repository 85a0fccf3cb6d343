#include "src/ros2/topics.h"

#include <doctest/doctest.h>

#include "tests/recording/support.h"

using namespace ear;
using namespace ear::ros2;
using ear::test::contains;
using ear::test::input_error_of;

namespace {

const std::string kImu = "sensor_msgs/msg/Imu", kImage = "sensor_msgs/msg/Image";

SensorTopics guessed(const std::vector<Topic>& there, const SensorTopics& stated = {}) {
  std::vector<std::string> notes;
  return guess_topics(stated, there, notes);
}

}  // namespace

TEST_CASE("topics: a RealSense camera's are found") {
  const SensorTopics topics =
      guessed({{"/camera/infra2/image_rect_raw", kImage},
               {"/camera/infra1/image_rect_raw", kImage},
               {"/camera/depth/image_rect_raw", kImage},
               {"/camera/color/image_raw", kImage},
               {"/camera/gyro/sample", kImu},
               {"/camera/accel/sample", kImu},
               {"/camera/infra1/image_rect_raw/compressed", "sensor_msgs/msg/CompressedImage"}});
  CHECK(topics.left == "/camera/infra1/image_rect_raw");
  CHECK(topics.right == "/camera/infra2/image_rect_raw");
  CHECK(topics.left_info == "/camera/infra1/camera_info");
  CHECK(topics.imu_apart());
  CHECK(topics.gyro == "/camera/gyro/sample");
  CHECK(topics.accel == "/camera/accel/sample");
  CHECK(topics.wheels.empty());
}

TEST_CASE("topics: one IMU with both goes before one apart, and every guess is told") {
  std::vector<std::string> notes;
  const SensorTopics topics = guess_topics({}, {{"/gyro", kImu}, {"/accel", kImu}, {"/imu", kImu}}, notes);
  CHECK(topics.imu == "/imu");
  REQUIRE(notes.size() == 1);
  CHECK(notes[0] == "imu: /imu, the first of /accel, /gyro, /imu");
}

TEST_CASE("topics: what is stated stays, and nothing of its kind is guessed") {
  SensorTopics stated;
  stated.left = "/front";
  const SensorTopics topics = guessed({{"/a/left", kImage}, {"/a/right", kImage}, {"/imu", kImu}}, stated);
  CHECK(topics.left == "/front");
  CHECK(topics.right.empty());
  CHECK(topics.imu == "/imu");
}

TEST_CASE("topics: cameras of any names are taken in alphabetical order, ranges before scans") {
  const SensorTopics topics = guessed({{"/y", kImage},
                                       {"/x", kImage},
                                       {"/scan", "sensor_msgs/msg/LaserScan"},
                                       {"/tof/b", "sensor_msgs/msg/Range"},
                                       {"/tof/a", "sensor_msgs/msg/Range"},
                                       {"/arm/joints", "sensor_msgs/msg/JointState"},
                                       {"/wheel_states", "sensor_msgs/msg/JointState"}});
  CHECK(topics.left == "/x");
  CHECK(topics.right == "/y");
  CHECK(topics.wheels == "/wheel_states");
  CHECK(topics.beam_count() == 2);
  CHECK(topics.beams[0] == "/tof/a");
}

TEST_CASE("topics: only compressed images, with their camera's info") {
  const SensorTopics topics = guessed({{"/cam/left/compressed", "sensor_msgs/msg/CompressedImage"}});
  CHECK(topics.left == "/cam/left/compressed");
  CHECK(topics.left_info == "/cam/camera_info");
}

TEST_CASE("topics: from a configuration file") {
  const test::TempFolder folder;
  test::write_text(
      folder / "c.yaml",
      "filter: {window: 9}\ntopics: {gyro: /g, accel: /a, left_joint: l, beam_1: /b, calibration: sensors}\n");
  const SensorTopics topics = load_sensor_topics(folder / "c.yaml");
  CHECK(topics.imu_apart());
  CHECK(topics.left_joint == "l");
  CHECK(topics.beams[1] == "/b");
  CHECK(topics.base_frame == "base_link");
  CHECK(topics.calibration == folder / "sensors");
  const auto error = [&](const std::string& text) {
    test::write_text(folder / "c.yaml", text);
    return input_error_of([&] { static_cast<void>(load_sensor_topics(folder / "c.yaml")); });
  };
  CHECK(contains(error("topics: {imo: /imu}\n"), "imo"));
  CHECK(contains(error("topics: {gyro: /g}\n"), "needs accel"));
  CHECK(contains(error("topics: {gyro: /g, accel: /a, imu: /i}\n"), "either imu, or gyro and accel"));
}
