// An estimate of one's own to a flight controller: sends ODOMETRY over UDP, and plays the other end, too.
#include <src/mavlink/link.h>
#include <src/mavlink/odometry_message.h>

#include <array>
#include <cstdlib>
#include <iostream>

namespace mavlink = ear::mavlink;

int main() {
  mavlink::Transport controller("udpin:127.0.0.1:0");  // where the flight controller would be
  mavlink::Link link("udp:127.0.0.1:" + std::to_string(controller.local_port()), mavlink::Sender{},
                     [] { return ear::TimeNs{1000}; });

  ear::NavState state;
  state.t_ns = 5'000'000'000;
  state.p_WB = {1.0, 2.0, 3.0};
  const Eigen::Matrix3d R_BV = mavlink::mounting_of(0.0, 0.0, 0.0);  // the IMU's x is forward, its z up
  link.send(mavlink::make_odometry(state, Eigen::Vector3d::Zero(), R_BV));

  mavlink::Parser parser;
  std::array<std::uint8_t, 512> bytes{};
  for (int i = 0; i < 100; ++i) {
    const std::size_t count = controller.receive(bytes.data(), bytes.size(), 50);
    for (const mavlink::Packet& packet : parser.add(bytes.data(), count)) {
      if (packet.payload.type.id != mavlink::kOdometryType.id) continue;
      std::cout << "the flight controller got " << count << " bytes of ODOMETRY\n";
      return EXIT_SUCCESS;
    }
  }
  std::cerr << "nothing came\n";
  return EXIT_FAILURE;
}
