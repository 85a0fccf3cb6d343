// Hashes that the project's structs give, against those of the headers that rosidl generates for ROS 2 Jazzy.
#include "src/ros2/type_hash.h"

#include <doctest/doctest.h>

#include "src/ros2/sha256.h"

using namespace ear::ros2;

namespace {

std::string hex(const std::array<std::uint8_t, 32>& bytes) {
  const char* const digits = "0123456789abcdef";
  std::string text;
  for (const std::uint8_t byte : bytes) text += {digits[byte / 16], digits[byte % 16]};
  return text;
}

}  // namespace

TEST_CASE("sha256: the examples of FIPS 180-4, and lengths around a block") {
  CHECK(hex(sha256("abc")) == "ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad");
  CHECK(hex(sha256("")) == "e3b0c44298fc1c149afbf4c8996fb92427ae41e4649b934ca495991b7852b855");
  CHECK(hex(sha256("abcdbcdecdefdefgefghfghighijhijkijkljklmklmnlmnomnopnopq")) ==
        "248d6a61d20638b8e5c026930c3e6039a33ce45964ff2167f6ecedd419db06c1");
  CHECK(hex(sha256(std::string(1'000'000, 'a'))) == "cdc76e5c9914fb9281a1c7e284d73e67f1809a48a497200e046d39ccc7112cd0");
}

TEST_CASE("type hash: those of ROS 2 Jazzy") {
  CHECK(type_hash_of("nav_msgs/msg/Odometry") ==
        "RIHS01_3cc97dc7fb7502f8714462c526d369e35b603cfc34d946e3f2eda2766dfec6e0");
  CHECK(type_hash_of("nav_msgs/msg/Path") == "RIHS01_1957a5bb3cee5da65c4e52e52b65a93df227efce4c20f8458b36e73066ca334b");
  CHECK(type_hash_of("tf2_msgs/msg/TFMessage") ==
        "RIHS01_e369d0f05a23ae52508854b66f6aa0437f3449d652e8cbf22d5abe85d020f087");
  CHECK(type_hash_of("diagnostic_msgs/msg/DiagnosticArray") ==
        "RIHS01_5a8a36efb05fb25070fa0fb3810290c0e6cd4862b54a8fb975a1ee8dc55a333e");
  CHECK(type_hash_of("sensor_msgs/msg/Image") ==
        "RIHS01_d31d41a9a4c4bc8eae9be757b0beed306564f7526c88ea6a4588fb9582527d47");
  CHECK(type_hash_of("sensor_msgs/msg/Range").empty());  // which has another field in each distribution
}
