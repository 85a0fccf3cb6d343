#include "src/bag/bag.h"

#include <doctest/doctest.h>

#include <cmath>
#include <optional>
#include <string>
#include <vector>

#include "src/recording/config_file.h"
#include "src/recording/recording.h"
#include "tests/recording/support.h"
#include "tests/support/skip.h"

using namespace ear;
using namespace ear::test;

namespace {

constexpr TimeNs kStart = 1'403'715'273'000'000'007;  // as in EuRoC: a double cannot hold it
constexpr int kImageWidth = 16, kImageHeight = 12;

/// sensor.yaml of all sensors, as `ear export` puts them beside a bag.
void write_calibration(const fs::path& folder) {
  write_text(folder / "imu0/sensor.yaml", kImuYaml);
  write_text(folder / "cam0/sensor.yaml", camera_yaml("0.05"));
  write_text(folder / "cam1/sensor.yaml", camera_yaml("-0.05"));
  write_text(folder / "encoder0/sensor.yaml", kEncoderYaml);
  write_text(folder / "laser0/sensor.yaml", kLaserYaml);
}

Calibration calibration() {
  Calibration c;
  c.encoder.emplace().resolution = 4096;
  c.lasers.emplace().beams.resize(3);
  return c;
}

ImuSample imu(int i) { return {kStart + i * 10'000'000, {0.1 / 3.0 + i, -0.2, 1e-9}, {0.3, -9.81 - i / 7.0, 1e5}}; }
EncoderSample encoder(int i) { return {kStart + i * 10'000'000, 4095 - i, -1'000'000 + 13 * i}; }
LaserSample laser(int i) { return {kStart + i * 20'000'000, {0.1 + i / 300.0, std::nan(""), 1.0 / 3.0}}; }

std::vector<std::uint8_t> picture(int i, int camera) {
  std::vector<std::uint8_t> pixels(kImageWidth * kImageHeight);
  for (std::size_t k = 0; k < pixels.size(); ++k)
    pixels[k] = static_cast<std::uint8_t>(k + 3U * unsigned(i) + 100U * unsigned(camera));
  return pixels;
}

ImageView view(const std::vector<std::uint8_t>& pixels) {
  return {pixels.data(), kImageWidth, kImageHeight, kImageWidth};
}

void write_bag(const fs::path& file, const BagTopics& topics = {}) {
  BagWriter bag(file, topics, calibration());
  for (int i = 0; i < 20; ++i) {
    bag.write(imu(i));
    bag.write(encoder(i));
    if (i % 2 == 0) bag.write(laser(i / 2));
    if (i % 5 == 0) {
      const auto left = picture(i, 0);
      const auto right = picture(i, 1);
      bag.write(StereoFrame{kStart + i * 10'000'000, view(left), view(right)}, kStart + i * 10'000'000 + 1);
    }
  }
  bag.write_truth(kStart, Eigen::Quaterniond::Identity(), Eigen::Vector3d(1, 2, 3));
  bag.close();
}

/// False, and skipped, where this program has no bags.
bool possible() {
  if (bags_are_built()) return true;
  skip("built without ROS bags");
  return false;
}

}  // namespace

TEST_CASE("bag: what is written is read again") {
  if (!possible()) return;
  const TempFolder folder;
  const fs::path file = folder / "a.bag";
  write_bag(file);
  write_calibration(calibration_folder(file, {}));
  unpack_bag(file, {}, folder / "unpacked");

  Recording recording(folder / "unpacked");
  int imus = 0, encoders = 0, lasers = 0, frames = 0;
  while (const auto sample = recording.next()) {
    std::visit(Overloaded{[&](const ImuSample& s) {
                            const ImuSample expected = imu(imus++);
                            CHECK(s.t_ns == expected.t_ns);
                            CHECK(s.gyro_B == expected.gyro_B);
                            CHECK(s.accel_B == expected.accel_B);
                          },
                          [&](const EncoderSample& s) {
                            const EncoderSample expected = encoder(encoders++);
                            CHECK(s.t_ns == expected.t_ns);
                            CHECK(s.left_count == expected.left_count);
                            CHECK(s.right_count == expected.right_count);
                          },
                          [&](const LaserSample& s) {
                            const LaserSample expected = laser(lasers++);
                            CHECK(s.t_ns == expected.t_ns);
                            REQUIRE(s.range.size() == 3);
                            CHECK(std::abs(s.range[0] - expected.range[0]) < 1e-7);  // messages hold floats
                            CHECK(std::isnan(s.range[1]));
                            CHECK(std::abs(s.range[2] - expected.range[2]) < 1e-7);
                          },
                          [&](const RecordedFrame& s) {
                            const int i = 5 * frames++;
                            CHECK(s.t_ns == kStart + i * 10'000'000);
                            REQUIRE(s.right.width == kImageWidth);
                            CHECK(std::equal(s.left.data, s.left.data + 16, picture(i, 0).data()));
                            CHECK(s.right.data[11 * s.right.stride + 15] == picture(i, 1).back());
                          }},
               *sample);
  }
  CHECK(imus == 20);
  CHECK(encoders == 20);
  CHECK(lasers == 10);
  CHECK(frames == 4);
  CHECK(recording.warnings().empty());
}

TEST_CASE("bag: topics and calibration by the configuration file") {
  const TempFolder folder;
  write_text(folder / "c.yaml",
             "filter: {window: 9}\ntopics: {imu: /alphasense/imu, beam_1: /front, calibration: sensors}\n");
  const BagTopics topics = load_topics(folder / "c.yaml");
  CHECK(topics.imu == "/alphasense/imu");
  CHECK(topics.left == BagTopics{}.left);
  CHECK(topics.beams[1] == "/front");
  CHECK(topics.calibration == folder / "sensors");
  CHECK(load_config(folder / "c.yaml").filter.window == 9);

  write_text(folder / "wrong.yaml", "topics: {imo: /imu}\n");
  CHECK(contains(input_error_of([&] { static_cast<void>(load_topics(folder / "wrong.yaml")); }), "imo"));

  if (!possible()) return;
  write_bag(folder / "a.bag", topics);
  write_calibration(calibration_folder(folder / "a.bag", {}));
  CHECK(contains(input_error_of([&] { unpack_bag(folder / "a.bag", {}, folder / "none"); }),
                 "no messages on this topic of the IMU; there are /alphasense/imu"));
  write_calibration(folder / "sensors");
  unpack_bag(folder / "a.bag", topics, folder / "out");
  CHECK(Recording(folder / "out").calibration().lasers);
}

TEST_CASE("bag: what cannot be is refused with file and topic") {
  if (!possible()) return;
  const TempFolder folder;
  write_text(folder / "text.bag", "no bag\n");
  CHECK(contains(input_error_of([&] { unpack_bag(folder / "text.bag", {}, folder / "a"); }), "text.bag"));
  CHECK(contains(input_error_of([&] { unpack_bag(folder / "missing.bag", {}, folder / "a"); }), "no such file"));

  write_bag(folder / "a.bag");  // and no calibration
  const std::string said = input_error_of([&] { unpack_bag(folder / "a.bag", {}, folder / "b"); });
  CHECK(contains(said, "no calibration"));
  CHECK(contains(said, "0/sensor.yaml does not exist"));

  write_calibration(calibration_folder(folder / "a.bag", {}));
  BagTopics swapped;
  swapped.imu = "/wheels";
  CHECK(contains(input_error_of([&] { unpack_bag(folder / "a.bag", swapped, folder / "c"); }),
                 "is of type sensor_msgs/JointState"));

  BagWriter early(folder / "early.bag", {}, calibration());
  CHECK(contains(input_error_of([&] { early.write(ImuSample{}); }), "a bag cannot hold the time 0 ns"));
}
