#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>

#include "src/ros2/image_messages.h"
#include "src/ros2/imu_messages.h"
#include "src/ros2/laser_messages.h"
#include "src/ros2/outgoing.h"
#include "src/ros2/wheel_messages.h"
#include "tests/recording/support.h"
#include "tests/ros2/support.h"

using namespace ear;
using namespace ear::ros2;
using ear::test::contains;
using ear::test::header;
using ear::test::input_error_of;
using ear::test::Sent;

namespace {

constexpr TimeNs kMs = 1'000'000;
constexpr TimeNs kStart = 1'403'715'273'000'000'007;

SensorTopics apart() {
  SensorTopics topics;
  topics.gyro = "/gyro";
  topics.accel = "/accel";
  return topics;
}

Imu rate(TimeNs t_ns, double x) {
  Imu imu;
  imu.header = header(t_ns);
  imu.angular_velocity.x = x;
  imu.linear_acceleration.x = 99.0;  // means nothing in this topic
  return imu;
}

Imu acceleration(TimeNs t_ns, double x) {
  Imu imu;
  imu.header = header(t_ns);
  imu.linear_acceleration.x = x;
  return imu;
}

Image image(const std::string& encoding, std::uint32_t step, std::vector<std::uint8_t> data) {
  Image message;
  message.header = header(kStart);
  message.width = 2;
  message.height = 2;
  message.encoding = encoding;
  message.step = step;
  message.data = std::move(data);
  return message;
}

/// The four pixels, by rows.
std::vector<int> grey(const Image& message) {
  Warnings warnings;
  const GreyImage result = grey_image(Sent("/left", message), "cam0", warnings);
  REQUIRE(result.pixels.size() == cv::Size(2, 2));
  std::vector<int> pixels;
  for (int i = 0; i < 4; ++i) pixels.push_back(result.pixels.at<std::uint8_t>(i / 2, i % 2));
  return pixels;
}

GreyImage empty_image(TimeNs t_ns) { return {t_ns, t_ns, cv::Mat(2, 2, CV_8U, cv::Scalar(0))}; }

}  // namespace

TEST_CASE("imu: united samples come as they are; a stamp of 0 is the time of arrival") {
  SensorTopics topics;
  topics.imu = "/imu";
  ImuMessages messages(topics);
  std::vector<ImuSample> samples;
  Warnings warnings;
  const ImuSample sample{kStart, {0.1 / 3.0, -2.0, 1e-9}, {0.3, -9.81, 1e5}};
  messages.take(Sent("/imu", imu_message(sample)), samples, warnings);
  messages.take(Sent("/imu", imu_message(ImuSample{}), kStart + 5), samples, warnings);
  REQUIRE(samples.size() == 2);
  CHECK(samples[0].t_ns == kStart);
  CHECK(samples[0].gyro_B == sample.gyro_B);
  CHECK(samples[0].accel_B == sample.accel_B);
  CHECK(samples[1].t_ns == kStart + 5);
}

TEST_CASE("imu: apart, the acceleration at each rate is interpolated, whichever comes first") {
  for (const bool accel_first : {true, false}) {
    CAPTURE(accel_first);
    ImuMessages messages(apart());
    std::vector<ImuSample> samples;
    Warnings warnings;
    const auto send_accel = [&] {
      for (int i = 0; i <= 4; ++i) messages.take(Sent("/accel", acceleration(i * 4 * kMs, i * 4.0)), samples, warnings);
    };
    const auto send_gyro = [&] {
      for (int i = 0; i <= 5; ++i) messages.take(Sent("/gyro", rate(kMs + i * 3 * kMs, i)), samples, warnings);
    };
    accel_first ? (send_accel(), send_gyro()) : (send_gyro(), send_accel());
    REQUIRE(samples.size() == 6);  // at 1, 4, 7, 10, 13 and 16 ms
    for (int i = 0; i <= 5; ++i) {
      CHECK(samples[std::size_t(i)].t_ns == kMs + i * 3 * kMs);
      CHECK(samples[std::size_t(i)].gyro_B.x() == i);
      CHECK(samples[std::size_t(i)].accel_B.x() == doctest::Approx(1.0 + 3.0 * i).epsilon(1e-12));
    }
    CHECK(warnings.empty());
  }
}

TEST_CASE("imu: rates that no two accelerations enclose are left out, and counted") {
  ImuMessages messages(apart());
  std::vector<ImuSample> samples;
  Warnings warnings;
  messages.take(Sent("/gyro", rate(1 * kMs, 1.0)), samples, warnings);  // before the first
  messages.take(Sent("/accel", acceleration(2 * kMs, 1.0)), samples, warnings);
  messages.take(Sent("/gyro", rate(50 * kMs, 1.0)), samples, warnings);  // in a gap of 0.2 s
  messages.take(Sent("/accel", acceleration(202 * kMs, 1.0)), samples, warnings);
  messages.take(Sent("/gyro", rate(203 * kMs, 1.0)), samples, warnings);
  messages.take(Sent("/accel", acceleration(204 * kMs, 1.0)), samples, warnings);
  messages.take(Sent("/accel", acceleration(203 * kMs, 1.0)), samples, warnings);  // runs backward
  REQUIRE(samples.size() == 1);
  CHECK(samples[0].t_ns == 203 * kMs);
  REQUIRE(warnings.list().size() == 2);
  CHECK(warnings.list()[0].kind == "imu0: no acceleration around a rate");
  CHECK(warnings.list()[0].count == 2);
  CHECK(warnings.list()[1].kind == "imu0: backward stamp");
}

TEST_CASE("imu: without accelerations memory is bounded") {
  ImuMessages messages(apart());
  std::vector<ImuSample> samples;
  Warnings warnings;
  for (int i = 0; i < 10'000; ++i) messages.take(Sent("/gyro", rate((i + 1) * kMs, 0.0)), samples, warnings);
  REQUIRE(warnings.list().size() == 1);
  CHECK(warnings.list()[0].count == 6000);
  CHECK(samples.empty());
}

TEST_CASE("messages of another type or with wrong bytes name the topic") {
  SensorTopics topics;
  topics.imu = "/imu";
  ImuMessages messages(topics);
  std::vector<ImuSample> samples;
  Warnings warnings;
  CHECK(contains(input_error_of([&] { messages.take(Sent("/imu", JointState{}), samples, warnings); }),
                 "/imu: is of type sensor_msgs/msg/JointState, not sensor_msgs/msg/Imu"));
  const std::vector<std::uint8_t> bytes(8);
  CHECK(contains(input_error_of([&] {
                   messages.take({"/imu", Imu::kType, 0, {bytes.data(), 8}}, samples, warnings);
                 }),
                 "/imu: sensor_msgs/msg/Imu: "));
}

TEST_CASE("wheels: counts come back, of joints by their names") {
  WheelMessages messages({}, 4096);
  for (const std::int64_t count : {0L, 1L, 4095L, -77'777'777L, 123'456'789'012L}) {
    const EncoderSample sample{kStart, count, -count};
    const EncoderSample read = messages.take(Sent("/wheels", joint_message(sample, 4096)));
    CHECK(read.t_ns == kStart);
    CHECK(read.left_count == count);
    CHECK(read.right_count == -count);
  }
  CHECK(messages.joints() == "left, right");

  JointState arm;
  arm.name = {"right_arm", "left_arm", "rear_right_wheel", "rear_left_wheel"};
  arm.position = {9.0, 9.0, M_PI, 2.0 * M_PI};
  WheelMessages guessed({}, 1000);
  CHECK(guessed.take(Sent("/j", arm, kStart)).left_count == 1000);
  CHECK(guessed.take(Sent("/j", arm, kStart)).right_count == 500);
  CHECK(guessed.joints() == "rear_left_wheel, rear_right_wheel");

  SensorTopics stated;
  stated.left_joint = "right_arm";
  stated.right_joint = "left_arm";
  CHECK(WheelMessages(stated, 1000).take(Sent("/j", arm, kStart)).left_count == 1432);
  stated.left_joint = "nothing";
  CHECK(contains(input_error_of([&] { static_cast<void>(WheelMessages(stated, 1000).take(Sent("/j", arm, kStart))); }),
                 "/j: no joint nothing among right_arm, left_arm"));
  arm.position = {};
  CHECK(contains(input_error_of([&] { static_cast<void>(guessed.take(Sent("/j", arm, kStart))); }), "0 angles"));
  arm.position = {9.0, 9.0, std::nan(""), 1.0};
  CHECK(contains(input_error_of([&] { static_cast<void>(guessed.take(Sent("/j", arm, kStart))); }), "no angle"));
}

TEST_CASE("lasers: a range is the decimal number that was meant") {
  for (const double range : {0.1235, 0.02, 3.9999, 1.0 / 8.0}) CHECK(range_of(static_cast<float>(range)) == range);
  CHECK(std::isnan(range_of(std::numeric_limits<float>::infinity())));
}

TEST_CASE("lasers: beams of one instant are one reading") {
  SensorTopics topics;
  topics.beams = {"/a", "/b", ""};
  LaserCalibration lasers;
  lasers.beams.resize(2);
  LaserMessages messages(topics, lasers);
  std::vector<LaserSample> samples;
  const auto send = [&](const std::string& topic, TimeNs t_ns, double range) {
    LaserSample sample{t_ns, {range}};
    messages.take(Sent(topic, range_message(sample, 0, lasers)), samples);
  };
  send("/a", 0 * kMs + kStart, 0.5);
  send("/b", 4 * kMs + kStart, std::nan(""));  // complete
  send("/b", 20 * kMs + kStart, 0.3);          // waits
  send("/b", 40 * kMs + kStart, 0.4);          // the one before has no other beam
  send("/a", 41 * kMs + kStart, 9.0);          // out of range
  send("/other", 41 * kMs + kStart, 1.0);
  REQUIRE(samples.size() == 3);
  CHECK(samples[0].t_ns == kStart);
  CHECK(samples[0].range[0] == 0.5);
  CHECK(std::isnan(samples[0].range[1]));
  CHECK(samples[1].t_ns == kStart + 20 * kMs);
  CHECK(std::isnan(samples[1].range[0]));
  CHECK(samples[1].range[1] == 0.3);
  CHECK(std::isnan(samples[2].range[0]));
  messages.finish(samples);
  CHECK(samples.size() == 3);

  // The messages of one topic may run ahead of the other's: nothing is torn apart.
  samples.clear();
  for (int i = 5; i < 9; ++i) send("/a", i * 20 * kMs + kStart, 0.1 * i);
  CHECK(samples.empty());
  for (int i = 5; i < 8; ++i) send("/b", i * 20 * kMs + kStart, 0.2 * i);
  REQUIRE(samples.size() == 3);
  CHECK(samples[2].t_ns == kStart + 140 * kMs);
  CHECK(samples[2].range[0] == doctest::Approx(0.7));
  CHECK(samples[2].range[1] == doctest::Approx(1.4));
  // One beam falls silent: the others are not held back for long, and not at all from then on.
  samples.clear();
  for (int i = 8; i < 50; ++i) send("/a", i * 20 * kMs + kStart, 0.5);
  CHECK(samples.size() > 39);
  CHECK(samples.back().t_ns == kStart + 49 * 20 * kMs);
  CHECK(std::is_sorted(samples.begin(), samples.end(),
                       [](const LaserSample& a, const LaserSample& b) { return a.t_ns < b.t_ns; }));

  LaserScan scan;
  scan.header = header(kStart);
  scan.range_max = 5.0F;
  scan.ranges = {1.25F};
  CHECK(range_message(Sent("/a", scan)).range == 1.25F);
  scan.ranges = {1.0F, 2.0F};
  CHECK(contains(input_error_of([&] { static_cast<void>(range_message(Sent("/a", scan))); }), "2 ranges"));
}

TEST_CASE("images: grey of each encoding, whatever the step") {
  CHECK(grey(image("mono8", 2, {1, 2, 3, 4})) == std::vector<int>{1, 2, 3, 4});
  CHECK(grey(image("8UC1", 3, {1, 2, 77, 3, 4})) == std::vector<int>{1, 2, 3, 4});
  CHECK(grey(image("mono16", 4, {0, 1, 0, 2, 0, 3, 0, 4})) == std::vector<int>{1, 2, 3, 4});
  Image big = image("mono16", 4, {1, 0, 2, 0, 3, 0, 4, 0});
  big.is_bigendian = 1;
  CHECK(grey(big) == std::vector<int>{1, 2, 3, 4});
  // Grey is 0.299 R + 0.587 G + 0.114 B (ITU-R BT.601).
  const std::vector<std::uint8_t> colours{100, 0, 0, 0, 100, 0, 0, 0, 100, 100, 100, 100};
  CHECK(grey(image("rgb8", 6, colours)) == std::vector<int>{30, 59, 11, 100});
  CHECK(grey(image("bgr8", 6, colours)) == std::vector<int>{11, 59, 30, 100});
  CHECK(grey(image("yuv422", 4, {9, 1, 9, 2, 9, 3, 9, 4})) == std::vector<int>{1, 2, 3, 4});
  CHECK(grey(image("yuv422_yuy2", 4, {1, 9, 2, 9, 3, 9, 4, 9})) == std::vector<int>{1, 2, 3, 4});
}

TEST_CASE("images: what is none is refused by name") {
  Warnings warnings;
  const auto error = [&](const Image& message) {
    return input_error_of([&] { static_cast<void>(grey_image(Sent("/left", message), "cam0", warnings)); });
  };
  CHECK(contains(error(image("32FC1", 8, std::vector<std::uint8_t>(16))), "/left: encoding '32FC1' is none of mono8"));
  CHECK(contains(error(image("mono8", 2, {1, 2, 3})), "3 bytes are no image of 2 x 2 mono8"));
  CHECK(contains(error(image("rgb8", 2, std::vector<std::uint8_t>(12))), "in rows of 2 bytes"));
  Image huge = image("mono8", 4'000'000'000U, {});
  huge.width = huge.height = 4'000'000'000U;
  CHECK(contains(error(huge), "no image"));

  CompressedImage torn;
  torn.header = header(kStart);
  torn.format = "png";
  torn.data = {0x89, 'P', 'N', 'G'};
  CHECK(grey_image(Sent("/left", torn), "cam0", warnings).pixels.empty());
  REQUIRE(warnings.list().size() == 1);
  CHECK(warnings.list()[0].kind == "cam0: unreadable image");
}

TEST_CASE("pairing: images of one instant are a frame, in whatever order they come") {
  StereoPairing pairing(true);
  std::vector<RecordedFrame> frames;
  Warnings warnings;
  const auto send = [&](std::size_t camera, TimeNs t_ns) { pairing.take(camera, empty_image(t_ns), frames, warnings); };
  send(1, 100 * kMs);
  send(0, 101 * kMs);  // 1 ms apart
  send(0, 133 * kMs);
  send(0, 166 * kMs);
  CHECK(frames.size() == 1);
  send(1, 166 * kMs);  // so the right one of 133 ms is lost
  send(1, 180 * kMs);  // without a left one
  send(0, 200 * kMs);
  send(0, 200 * kMs);
  send(1, 200 * kMs);
  REQUIRE(frames.size() == 4);
  CHECK(frames[0].t_ns == 101 * kMs);
  CHECK_FALSE(frames[0].right.empty());
  CHECK(frames[1].t_ns == 133 * kMs);
  CHECK(frames[1].right.empty());
  CHECK_FALSE(frames[2].right.empty());
  CHECK(frames[3].t_ns == 200 * kMs);
  std::vector<std::string> kinds;
  for (const Warning& warning : warnings.list()) kinds.push_back(warning.kind);
  CHECK(kinds == std::vector<std::string>{"cam0: image without a right one", "cam1: image without a left one",
                                          "cam0: duplicate stamp"});
}

TEST_CASE("pairing: a camera that stops holds up nothing for long") {
  StereoPairing pairing(true);
  std::vector<RecordedFrame> frames;
  Warnings warnings;
  for (int i = 0; i < 100; ++i) pairing.take(0, empty_image(i * 33 * kMs), frames, warnings);
  CHECK(frames.size() == 92);
  pairing.finish(frames, warnings);
  CHECK(frames.size() == 100);

  StereoPairing no_left(true);
  for (int i = 0; i < 100; ++i) no_left.take(1, empty_image(i * 33 * kMs), frames, warnings);
  CHECK(warnings.list().back().kind == "cam1: image without a left one");
  CHECK(warnings.list().back().count == 92);

  StereoPairing mono(false);
  frames.clear();
  mono.take(0, empty_image(kMs), frames, warnings);
  CHECK(frames.size() == 1);
}

TEST_CASE("images: one stamp that is far ahead does not end the stream, nor does a clock that is set back") {
  StereoPairing pairing(false);
  std::vector<RecordedFrame> frames;
  Warnings warnings;
  const auto take = [&](TimeNs t_ns) {
    GreyImage grey;
    grey.t_ns = grey.arrival_ns = t_ns;
    grey.pixels = cv::Mat(2, 2, CV_8UC1, cv::Scalar(1));
    pairing.take(0, std::move(grey), frames, warnings);
  };
  take(kStart);
  take(kStart + 3'600'000 * kMs);  // false
  for (int i = 1; i <= 20; ++i) take(kStart + i * 33 * kMs);
  REQUIRE(frames.size() == 2 + 16);
  CHECK(frames[2].t_ns == kStart + 5 * 33 * kMs);
  for (int i = 0; i < 10; ++i) take(kStart - 5000 * kMs + i * 33 * kMs);
  CHECK(frames.size() == 18 + 6);
  take(kStart - 5000 * kMs);  // one that is late stays out
  take(kStart - 4000 * kMs);
  CHECK(frames.size() == 25);
}

TEST_CASE("imu apart: one stamp that is far ahead ends neither rates nor accelerations") {
  for (const char* broken : {"/gyro", "/accel"}) {
    CAPTURE(broken);
    ImuMessages messages(apart());
    std::vector<ImuSample> samples;
    Warnings warnings;
    for (int i = 0; i < 100; ++i) {
      const TimeNs t_ns = kStart + i * 5 * kMs;
      const auto stamp = [&](const char* topic) {
        return topic == std::string(broken) && i == 10 ? t_ns + 60'000 * kMs : t_ns;
      };
      messages.take(Sent("/gyro", rate(stamp("/gyro"), 1.0)), samples, warnings);
      messages.take(Sent("/accel", acceleration(stamp("/accel"), 2.0)), samples, warnings);
    }
    CHECK(samples.size() > 85);
  }
}
