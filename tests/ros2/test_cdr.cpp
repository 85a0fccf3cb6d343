#include "src/ros2/cdr.h"

#include <doctest/doctest.h>

#include <cstring>
#include <limits>

#include "src/ros2/definition.h"
#include "tests/recording/support.h"

using namespace ear;
using namespace ear::ros2;
using ear::test::contains;
using ear::test::input_error_of;

namespace {

Bytes view(const std::vector<std::uint8_t>& bytes) { return {bytes.data(), bytes.size()}; }

JointState joints() {
  JointState state;
  state.header = {{1'700'000'000, 999'999'999}, "base_link"};
  state.name = {"left", "", "right wheel"};
  state.position = {1.5, -2.25, std::numeric_limits<double>::infinity()};
  return state;
}

}  // namespace

TEST_CASE("cdr: the bytes of a message, by hand") {
  // XCDR1: four bytes of representation, then fields at multiples of their size, counted from behind these four.
  const std::vector<std::uint8_t> expected{0, 1, 0, 0, 7, 0, 0, 0, 9, 0, 0, 0, 3, 0, 0, 0, 'a', 'b', 0};
  CHECK(encode(Header{{7, 9}, "ab"}) == expected);

  const std::vector<std::uint8_t> big{0, 0, 0, 0, 0, 0, 0, 7, 0, 0, 0, 9, 0, 0, 0, 3, 'a', 'b', 0};
  CHECK(encode(Header{{7, 9}, "ab"}, ByteOrder::big) == big);
  CHECK(decode<Header>(view(big)).stamp.nanosec == 9);
  CHECK(decode<Header>(view(big)).frame_id == "ab");

  JointState state;  // after 4+4+4+1 bytes come 3 to align the count of names
  state.position = {1.0};
  const std::vector<std::uint8_t> bytes = encode(state);
  REQUIRE(bytes.size() == 4 + 16 + 4 + 4 + 8 + 8);
  CHECK(bytes[4 + 20] == 1);
  CHECK(bytes[4 + 24 + 7] == 0x3f);  // 1.0 at a multiple of 8
}

TEST_CASE("cdr: what is written is read, in both byte orders") {
  for (const ByteOrder order : {ByteOrder::little, ByteOrder::big}) {
    const auto state = decode<JointState>(view(encode(joints(), order)));
    CHECK(state.header.frame_id == "base_link");
    CHECK(nanoseconds(state.header.stamp) == 1'700'000'000'999'999'999);
    CHECK(state.name == joints().name);
    CHECK(state.position == joints().position);
    CHECK(state.effort.empty());

    CameraInfo info;
    info.d = {0.1, 0.2};
    info.p[11] = 5.0;
    info.roi.do_rectify = true;
    const auto read = decode<CameraInfo>(view(encode(info, order)));
    CHECK(read.d == info.d);
    CHECK(read.p == info.p);
    CHECK(read.roi.do_rectify);

    DiagnosticArray diagnostics;
    diagnostics.status.push_back({DiagnosticStatus::kWarn, "ear", "m", "", {{"k", "v"}, {"k2", ""}}});
    const auto told = decode<DiagnosticArray>(view(encode(diagnostics, order)));
    REQUIRE(told.status.size() == 1);
    CHECK(told.status[0].level.value == 1);
    REQUIRE(told.status[0].values.size() == 2);
    CHECK(told.status[0].values[1].key == "k2");
  }
}

TEST_CASE("cdr: whatever the length, a message that was cut off is an error that names type and field") {
  const std::vector<std::uint8_t> bytes = encode(joints());
  for (std::size_t size = 0; size < bytes.size(); ++size) {
    CAPTURE(size);
    const std::vector<std::uint8_t> cut(bytes.begin(), bytes.begin() + static_cast<std::ptrdiff_t>(size));
    CHECK(contains(input_error_of([&] { static_cast<void>(decode<JointState>(view(cut))); }),
                   "sensor_msgs/msg/JointState: "));
  }
  std::vector<std::uint8_t> longer = bytes;
  longer.resize(longer.size() + 3);  // as the wire pads it
  CHECK(decode<JointState>(view(longer)).name.size() == 3);
}

TEST_CASE("cdr: false lengths take no memory") {
  std::vector<std::uint8_t> image = encode(Image{});
  image[image.size() - 1] = 0x7f;  // the count of its data: 2 GiB
  CHECK(contains(input_error_of([&] { static_cast<void>(decode<Image>(view(image))); }),
                 "sensor_msgs/msg/Image: data: says 2130706432 elements, but 0 bytes are left"));
  std::vector<std::uint8_t> tf = encode(TfMessage{});
  std::memset(tf.data() + 4, 0xff, 4);
  CHECK(contains(input_error_of([&] { static_cast<void>(decode<TfMessage>(view(tf))); }), "transforms: says"));
  std::vector<std::uint8_t> text = encode(Header{{}, "abc"});
  std::memset(text.data() + 12, 0xff, 4);
  CHECK(contains(input_error_of([&] { static_cast<void>(decode<Header>(view(text))); }), "frame_id"));
}

TEST_CASE("cdr: other representations are named") {
  std::vector<std::uint8_t> bytes = encode(joints());
  bytes[1] = 7;  // XCDR2
  CHECK(contains(input_error_of([&] { static_cast<void>(decode<JointState>(view(bytes))); }), "representation 7"));
}

TEST_CASE("cdr: names of types") {
  CHECK(canonical_type("sensor_msgs::msg::dds_::Imu_") == "sensor_msgs/msg/Imu");
  CHECK(canonical_type("sensor_msgs/Imu") == "sensor_msgs/msg/Imu");
  CHECK(canonical_type("sensor_msgs/msg/Imu") == "sensor_msgs/msg/Imu");
  CHECK(canonical_type("tf2_msgs::msg::dds_::TFMessage_") == "tf2_msgs/msg/TFMessage");
  CHECK(canonical_type("") == "");
  CHECK(canonical_type("::::") == "//");
}

TEST_CASE("messages: times that they cannot hold") {
  CHECK(nanoseconds(time_of_stamp(1'403'715'273'000'000'007)) == 1'403'715'273'000'000'007);
  CHECK(contains(input_error_of([] { static_cast<void>(time_of_stamp(-1)); }), "cannot hold the time -1 ns"));
  CHECK_FALSE(input_error_of([] { static_cast<void>(time_of_stamp(kLargestStamp)); }).empty());
}

TEST_CASE("definition: fields, and each type within once") {
  const std::string text = definition_of("tf2_msgs/msg/TFMessage");
  CHECK(text.substr(0, 48) == "geometry_msgs/TransformStamped[] transforms\n====");
  CHECK(contains(text, "MSG: geometry_msgs/Vector3\nfloat64 x\nfloat64 y\nfloat64 z\n"));
  CHECK(text.find("MSG: std_msgs/Header") == text.rfind("MSG: std_msgs/Header"));
  CHECK(contains(definition_of("sensor_msgs/msg/CameraInfo"), "float64[12] p\n"));
  CHECK(contains(definition_of("diagnostic_msgs/msg/DiagnosticArray"), "byte level\n"));
  CHECK(definition_of("std_msgs/msg/Nothing").empty());
}
