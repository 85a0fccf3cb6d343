// Real sockets of this machine, and a pseudo-terminal for a serial line.
#include <doctest/doctest.h>
#include <fcntl.h>
#include <unistd.h>

#include <array>
#include <chrono>
#include <cstdlib>
#include <functional>
#include <stdexcept>
#include <system_error>
#include <utility>

#include "src/mavlink/link.h"

using namespace ear;
using namespace ear::mavlink;

namespace {

using Seconds = std::chrono::duration<double>;
constexpr Sender kFlightController{1, 1};
constexpr Seconds kPatience{60.0};  // on a machine that is busy with other things
constexpr TimeNs kNow = 77'000'000'000;

/// The packets that come until `enough` says so.
std::vector<Packet> listen(Transport& transport, const std::function<bool(const Packet&)>& enough) {
  Parser parser;
  std::vector<Packet> packets;
  std::array<std::uint8_t, 512> bytes{};
  const auto end = std::chrono::steady_clock::now() + kPatience;
  while (std::chrono::steady_clock::now() < end) {
    const std::size_t count = transport.receive(bytes.data(), bytes.size(), 20);
    for (const Packet& packet : parser.add(bytes.data(), count)) {
      packets.push_back(packet);
      if (enough(packet)) return packets;
    }
  }
  return packets;
}

bool is(const Packet& packet, const MessageType& type) { return packet.payload.type.id == type.id; }

std::vector<std::uint8_t> time_request(std::int64_t ts1, std::uint8_t system = 0) {
  return to_bytes({kFlightController, 0, to_payload(TimeSync{0, ts1, system, 0})});
}

std::string local(const char* scheme, std::uint16_t port) {
  return std::string(scheme) + ":127.0.0.1:" + std::to_string(port);
}

}  // namespace

TEST_CASE("mavlink link: heartbeats come once a second, and number their packets") {
  Transport controller("udpin:127.0.0.1:0");
  const auto begin = std::chrono::steady_clock::now();
  Link link(local("udp", controller.local_port()), Sender{}, [] { return kNow; });
  link.set_state(SystemState::active);
  int heartbeats = 0;
  const std::vector<Packet> packets = listen(controller, [&](const Packet&) { return ++heartbeats == 3; });
  const Seconds duration = std::chrono::steady_clock::now() - begin;
  CHECK(duration.count() > 2.0);  // the first comes at once
  REQUIRE(packets.size() == 3);
  for (std::size_t i = 0; i < packets.size(); ++i) {
    CHECK(is(packets[i], kHeartbeatType));
    CHECK(packets[i].sequence == i);
    CHECK(packets[i].sender.component == 197);
  }
  CHECK(packets[2].payload.bytes[7] == static_cast<std::uint8_t>(SystemState::active));
}

TEST_CASE("mavlink link: requests for the time are answered, whichever side listens") {
  for (const bool link_listens : {false, true}) {
    CAPTURE(link_listens);
    Transport first("udpin:127.0.0.1:0");
    Link link(link_listens ? "udpin:127.0.0.1:0" : local("udp", first.local_port()), Sender{}, [] { return kNow; });
    Transport second(link_listens ? local("udp", link.local_port()) : "udpin:127.0.0.1:0");
    Transport& controller = link_listens ? second : first;
    if (!link_listens) listen(controller, [](const Packet&) { return true; });  // learns the port

    REQUIRE(controller.send(time_request(123)));
    const std::vector<Packet> packets =
        listen(controller, [](const Packet& packet) { return is(packet, kTimeSyncType); });
    REQUIRE_FALSE(packets.empty());
    const auto answer = to_time_sync(packets.back().payload);
    REQUIRE(answer);
    CHECK(answer->tc1 == kNow);
    CHECK(answer->ts1 == 123);
    CHECK(answer->target_system == kFlightController.system);
    CHECK(answer->target_component == kFlightController.component);
  }
}

TEST_CASE("mavlink link: answers of others, and requests to others, are not answered") {
  const auto packet = [](const TimeSync& message) { return Packet{kFlightController, 0, to_payload(message)}; };
  const Sender self{3, 197};
  CHECK(answer_to(packet({0, 1, 0, 0}), self, kNow));
  CHECK(answer_to(packet({0, 1, 3, 197}), self, kNow));
  CHECK_FALSE(answer_to(packet({0, 1, 4, 0}), self, kNow));
  CHECK_FALSE(answer_to(packet({0, 1, 3, 100}), self, kNow));
  CHECK_FALSE(answer_to(packet({9, 1, 3, 197}), self, kNow));
  CHECK_FALSE(answer_to({kFlightController, 0, to_payload(Heartbeat{})}, self, kNow));
}

TEST_CASE("mavlink link: nobody there is no error, and is counted") {
  std::uint16_t port = 0;
  {
    const Transport closed("udpin:127.0.0.1:0");
    port = closed.local_port();
  }
  Link link(local("udp", port), Sender{}, [] { return kNow; });
  for (int i = 0; i < 10; ++i) link.send(StatusText{Severity::notice, "anyone?"});
  CHECK(link.counts().dropped > 0);

  Link silent("udpin:127.0.0.1:0", Sender{}, [] { return kNow; });
  silent.send(OdometryMessage{});
  CHECK(silent.counts().odometry == 0);
}

TEST_CASE("mavlink link: over a serial line") {
  const int terminal = ::posix_openpt(O_RDWR | O_NOCTTY);
  REQUIRE(terminal >= 0);
  REQUIRE(::grantpt(terminal) == 0);
  REQUIRE(::unlockpt(terminal) == 0);
  const std::string device = ::ptsname(terminal);
  {
    Link link("serial:" + device + ":921600", Sender{}, [] { return kNow; });
    OdometryMessage message;
    message.p_L = {1.0, 2.0, 0x0A0D * 1.0};  // bytes that a terminal would like to change
    message.time_us = 0x0D0A0D0A11131113;
    link.send(message);
    const std::vector<std::uint8_t> request = time_request(5);
    REQUIRE(::write(terminal, request.data(), request.size()) == static_cast<ssize_t>(request.size()));

    Parser parser;
    bool odometry = false;
    bool answer = false;
    std::array<std::uint8_t, 512> bytes{};
    for (int i = 0; i < 100 && !(odometry && answer); ++i) {
      const ssize_t count = ::read(terminal, bytes.data(), bytes.size());
      REQUIRE(count > 0);
      for (const Packet& packet : parser.add(bytes.data(), static_cast<std::size_t>(count))) {
        odometry |= is(packet, kOdometryType) && packet.payload.bytes == to_payload(message).bytes;
        answer |= is(packet, kTimeSyncType);
      }
    }
    CHECK(odometry);
    CHECK(answer);
  }
  ::close(terminal);
}

TEST_CASE("mavlink transport: a bad address says what is wrong with it") {
  const auto error = [](const std::string& address) -> std::string {
    try {
      const Transport transport(address);
    } catch (const std::invalid_argument& e) {
      return e.what();
    } catch (const std::system_error& e) {
      return e.what();
    }
    return "";
  };
  const auto contains = [](const std::string& text, const char* part) { return text.find(part) != std::string::npos; };
  CHECK(contains(error("udp"), "udp:HOST:PORT"));
  CHECK(contains(error("udp:127.0.0.1"), "udp:HOST:PORT"));
  CHECK(contains(error("udp:127.0.0.1:"), "udp:HOST:PORT"));
  CHECK(contains(error("tcp:127.0.0.1:5760"), "'tcp' is not udp, udpin or serial"));
  CHECK(contains(error("udp:127.0.0.1:port"), "127.0.0.1:port"));
  CHECK(contains(error("serial:/dev/null:1234"), "'1234' is not a baud rate"));
  CHECK(contains(error("serial:/dev/none:57600"), "/dev/none"));
  CHECK(contains(error("serial:/dev/null:57600"), "/dev/null"));  // not a terminal
}
