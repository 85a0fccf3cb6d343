// MAVLink 2 packets: payloads to bytes on the wire and back (https://mavlink.io/en/guide/serialization.html).
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "src/mavlink/messages.h"

namespace ear::mavlink {

/// The sender. The system is the vehicle; the component is this program on it.
struct Sender {
  std::uint8_t system = 1;
  std::uint8_t component = 197;  ///< MAV_COMP_ID_VISUAL_INERTIAL_ODOMETRY
};

struct Packet {
  Sender sender;
  std::uint8_t sequence = 0;  ///< one more with each packet of a sender, so that losses show
  Payload payload;
};

/// CRC-16/MCRF4XX, MAVLink's "X.25": of `bytes`, going on from `crc`.
[[nodiscard]] std::uint16_t checksum(const std::uint8_t* bytes, std::size_t count, std::uint16_t crc = 0xFFFF);

/// The packet on the wire, unsigned, the zeros at the payload's end left out.
[[nodiscard]] std::vector<std::uint8_t> to_bytes(const Packet& packet);

/// Finds packets in a stream of bytes that may begin anywhere and hold anything. Only the messages of messages.h are
/// found: for others it has no checksum. Signatures are skipped, not checked.
class Parser {
 public:
  /// The packets that these bytes complete.
  [[nodiscard]] std::vector<Packet> add(const std::uint8_t* bytes, std::size_t count);

 private:
  std::vector<std::uint8_t> waiting_;  ///< a packet's beginning, at most its longest length
};

}  // namespace ear::mavlink
