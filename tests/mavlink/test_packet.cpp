#include <doctest/doctest.h>

#include <fstream>
#include <map>
#include <random>
#include <sstream>

#include "src/mavlink/packet.h"

using namespace ear::mavlink;

namespace {

using Bytes = std::vector<std::uint8_t>;

Bytes from_hex(const std::string& text) {
  Bytes bytes;
  for (std::size_t i = 0; i + 1 < text.size(); i += 2) {
    bytes.push_back(static_cast<std::uint8_t>(std::stoi(text.substr(i, 2), nullptr, 16)));
  }
  return bytes;
}

/// What another implementation makes of the values in decoder/encode.mjs, by name.
std::map<std::string, Bytes> reference_packets() {
  std::ifstream file(EAR_SOURCE_DIR "/tests/mavlink/reference_packets.txt");
  std::map<std::string, Bytes> packets;
  for (std::string name, hex; file >> name >> hex;) packets[name] = from_hex(hex);
  REQUIRE(packets.size() == 9);
  return packets;
}

/// Upper triangle row by row: first, first + 0.25, ...
Matrix6d counting_upwards(double first) {
  Matrix6d m = Matrix6d::Zero();
  for (int row = 0; row < 6; ++row) {
    for (int column = row; column < 6; ++column) {
      m(row, column) = m(column, row) = first;
      first += 0.25;
    }
  }
  return m;
}

OdometryMessage odometry_of_the_reference() {
  OdometryMessage message;
  message.time_us = 1'600'000'000'123'456;
  message.p_L = {1.5, -2.25, -0.75};
  message.q_LV = {0.5, -0.5, 0.5, -0.5};
  message.v_V = {0.125, -8.0, 3.0};
  message.w_V = {0.5, -1.0, 2.0};
  message.pose_covariance = counting_upwards(1.0);
  message.velocity_covariance = counting_upwards(-7.0);
  message.reset_counter = 9;
  message.quality = 87;
  return message;
}

Bytes joined(const std::vector<Bytes>& parts) {
  Bytes all;
  for (const Bytes& part : parts) all.insert(all.end(), part.begin(), part.end());
  return all;
}

std::vector<Packet> parse(const Bytes& bytes) { return Parser().add(bytes.data(), bytes.size()); }

Bytes time_request() { return reference_packets().at("time_request"); }

}  // namespace

TEST_CASE("mavlink packet: the checksum of the catalogue of CRCs") {
  const std::string text = "123456789";
  CHECK(checksum(reinterpret_cast<const std::uint8_t*>(text.data()), text.size()) == 0x6F91);
}

TEST_CASE("mavlink packet: the same bytes as another implementation") {
  const std::map<std::string, Bytes> reference = reference_packets();
  CHECK(to_bytes({{1, 197}, 0, to_payload(Heartbeat{SystemState::active})}) == reference.at("heartbeat"));
  CHECK(to_bytes({{1, 1}, 7, to_payload(TimeSync{0, 123456789012345, 0, 0})}) == reference.at("time_request"));
  CHECK(to_bytes({{42, 197}, 255, to_payload(TimeSync{1'600'000'000'000'000'001, -5, 1, 1})}) ==
        reference.at("time_answer"));
  CHECK(to_bytes({{1, 197}, 3, to_payload(StatusText{Severity::warning, "few features"})}) ==
        reference.at("status_text"));
  CHECK(to_bytes({{1, 197}, 200, to_payload(odometry_of_the_reference())}) == reference.at("odometry"));
}

TEST_CASE("mavlink packet: the first byte of a payload is never left out") {
  const Bytes bytes = to_bytes({{1, 197}, 0, to_payload(TimeSync{})});
  CHECK(bytes.size() == 10 + 1 + 2);
  REQUIRE(parse(bytes).size() == 1);
}

TEST_CASE("mavlink packet: a text that is too long is cut") {
  const Bytes bytes = to_bytes({{1, 197}, 0, to_payload(StatusText{Severity::notice, std::string(80, 'x')})});
  CHECK(bytes.size() == 10 + 51 + 2);
}

TEST_CASE("mavlink parser: reads what was written") {
  const std::vector<Packet> packets = parse(reference_packets().at("time_answer"));
  REQUIRE(packets.size() == 1);
  CHECK(packets[0].sender.system == 42);
  CHECK(packets[0].sender.component == 197);
  CHECK(packets[0].sequence == 255);
  const auto message = to_time_sync(packets[0].payload);
  REQUIRE(message);
  CHECK(message->tc1 == 1'600'000'000'000'000'001);
  CHECK(message->ts1 == -5);
  CHECK(message->target_system == 1);
  CHECK(message->target_component == 1);
  CHECK_FALSE(to_time_sync(to_payload(Heartbeat{})));
}

TEST_CASE("mavlink parser: packets cut anywhere, between noise") {
  std::mt19937_64 rng{3};
  Bytes noise(2000);
  for (std::uint8_t& byte : noise) byte = static_cast<std::uint8_t>(rng() % 4 == 0 ? 0xFD : rng());
  const Bytes stream = joined({time_request(), noise, time_request(), time_request(), noise, time_request(), noise});
  Parser parser;
  std::size_t found = 0;
  for (std::size_t at = 0; at < stream.size();) {
    const std::size_t count = std::min<std::size_t>(1 + rng() % 40, stream.size() - at);
    found += parser.add(stream.data() + at, count).size();
    at += count;
  }
  CHECK(found == 4);
}

TEST_CASE("mavlink parser: any changed bit is noticed") {
  const Bytes good = time_request();
  for (std::size_t byte = 0; byte < good.size(); ++byte) {
    for (unsigned bit = 0; bit < 8; ++bit) {
      Bytes bad = good;
      bad[byte] = static_cast<std::uint8_t>(bad[byte] ^ 1U << bit);
      CAPTURE(byte);
      CAPTURE(bit);
      CHECK(parse(bad).empty());
    }
  }
}

TEST_CASE("mavlink: sensors that another implementation sent") {
  const std::map<std::string, Bytes> reference = reference_packets();
  const auto payload_of = [&](const std::string& name) {
    const Bytes& bytes = reference.at(name);
    const std::vector<Packet> packets = Parser{}.add(bytes.data(), bytes.size());
    REQUIRE(packets.size() == 1);
    return packets[0].payload;
  };
  const auto imu = to_highres_imu(payload_of("highres_imu"));
  REQUIRE(imu);
  CHECK(imu->time_us == 1'234'567'890'123);
  CHECK(imu->accel == Eigen::Vector3d(1.5, -2.25, 9.75));
  CHECK(imu->gyro == Eigen::Vector3d(0.125, -0.5, 3.0));
  CHECK(imu->id == 2);

  const auto scaled = to_scaled_imu(payload_of("scaled_imu"));
  REQUIRE(scaled);
  CHECK(scaled->time_us == 4'000'000'001'000);
  CHECK(scaled->accel.isApprox(9.80665 * Eigen::Vector3d(1.0, -0.5, -1.0), 1e-12));
  CHECK(scaled->gyro.isApprox(Eigen::Vector3d(1.5, -0.002, 0.003), 1e-12));

  const auto wheels = to_wheel_distance(payload_of("wheel_distance"));
  REQUIRE(wheels);
  CHECK(wheels->time_us == 1'234'567'890'123);
  CHECK(wheels->count == 2);
  CHECK(wheels->distance[0] == 12.375);
  CHECK(wheels->distance[1] == -0.015625);

  const auto range = to_distance_sensor(payload_of("distance_sensor"));
  REQUIRE(range);
  CHECK(range->time_ms == 4'000'000'001);
  CHECK(range->distance == doctest::Approx(0.37));
  CHECK(range->most == doctest::Approx(4.0));
  CHECK(range->id == 7);
  CHECK(range->signal_quality == 55);
  CHECK_FALSE(to_highres_imu(payload_of("scaled_imu")));
}

TEST_CASE("mavlink: sensors come back as they were sent") {
  const ImuMessage imu{77, {1.0, 2.0, -9.5}, {0.25, -0.5, 4.0}, 1};
  CHECK(to_highres_imu(to_payload(imu))->accel == imu.accel);
  CHECK(to_highres_imu(to_payload(imu))->gyro == imu.gyro);
  CHECK(to_highres_imu(to_payload(imu))->id == 1);
  WheelDistance wheels{88, {}, 2};
  wheels.distance[1] = -1e6;
  CHECK(to_wheel_distance(to_payload(wheels))->distance == wheels.distance);
  const DistanceSensor range{99, 0.5, 0.02, 4.0, 3, 9};
  CHECK(to_distance_sensor(to_payload(range))->distance == doctest::Approx(0.5));
  CHECK(to_distance_sensor(to_payload(range))->id == 3);
}

TEST_CASE("mavlink parser: other messages and signatures are passed over") {
  Bytes unknown = time_request();
  unknown[7] = 30;  // ATTITUDE: whatever its checksum, it is not one of ours
  Bytes signed_request = to_bytes({{1, 1}, 0, to_payload(TimeSync{0, 5, 0, 0})});
  signed_request[2] = 0x01;
  const std::uint8_t crc_extra = kTimeSyncType.crc_extra;
  const std::size_t end = signed_request.size() - 2;
  const std::uint16_t crc = checksum(&crc_extra, 1, checksum(signed_request.data() + 1, end - 1));
  signed_request[end] = static_cast<std::uint8_t>(crc & 0xFFU);
  signed_request[end + 1] = static_cast<std::uint8_t>(crc >> 8);
  signed_request.insert(signed_request.end(), 13, 0xFD);
  CHECK(parse(joined({unknown, signed_request, time_request()})).size() == 2);
}
