#include "src/mavlink/packet.h"

#include <algorithm>
#include <array>
#include <optional>

namespace ear::mavlink {
namespace {

constexpr std::uint8_t kStart = 0xFD;
constexpr std::size_t kHeaderSize = 10;
constexpr std::size_t kChecksumSize = 2;
constexpr std::size_t kSignatureSize = 13;
constexpr std::uint8_t kSignedFlag = 0x01;

constexpr std::array<MessageType, 8> kTypes = {kHeartbeatType, kScaledImuType,      kHighresImuType,
                                               kTimeSyncType,  kDistanceSensorType, kStatusTextType,
                                               kOdometryType,  kWheelDistanceType};

std::optional<MessageType> find_type(std::uint32_t id) {
  for (const MessageType& type : kTypes) {
    if (type.id == id) return type;
  }
  return std::nullopt;
}

/// A packet's checksum: all but the start byte, then the seed of its message.
std::uint16_t packet_checksum(const std::uint8_t* packet, std::size_t payload_size, const MessageType& type) {
  return checksum(&type.crc_extra, 1, checksum(packet + 1, kHeaderSize - 1 + payload_size));
}

/// What stands at the beginning of some bytes.
struct Reading {
  enum class Kind { packet, incomplete, nothing } kind = Kind::nothing;
  std::size_t size = 1;  ///< bytes it takes
  Packet packet;
};

Reading read(const std::uint8_t* bytes, std::size_t count) {
  if (bytes[0] != kStart) return {};
  if (count < kHeaderSize) return {Reading::Kind::incomplete, 0, {}};
  const std::uint32_t id =
      bytes[7] | static_cast<std::uint32_t>(bytes[8]) << 8 | static_cast<std::uint32_t>(bytes[9]) << 16;
  const std::optional<MessageType> type = find_type(id);
  const std::uint8_t flags = bytes[2];
  if (!type || (flags & ~kSignedFlag) != 0) return {};

  const std::size_t payload_size = bytes[1];
  const std::size_t size =
      kHeaderSize + payload_size + kChecksumSize + ((flags & kSignedFlag) != 0 ? kSignatureSize : 0);
  if (count < size) return {Reading::Kind::incomplete, 0, {}};
  const std::uint8_t* const end = bytes + kHeaderSize + payload_size;
  const std::uint16_t crc = packet_checksum(bytes, payload_size, *type);
  if (end[0] != (crc & 0xFFU) || end[1] != crc >> 8) return {};

  Reading reading{Reading::Kind::packet, size, {{bytes[5], bytes[6]}, bytes[4], {*type, {}}}};
  std::copy(bytes + kHeaderSize, end, reading.packet.payload.bytes.begin());  // what was left out is zero
  return reading;
}

}  // namespace

std::uint16_t checksum(const std::uint8_t* bytes, std::size_t count, std::uint16_t crc) {
  constexpr unsigned kPolynomial = 0x8408;  // x^16 + x^12 + x^5 + 1, lowest bit first
  unsigned remainder = crc;
  for (std::size_t i = 0; i < count; ++i) {
    remainder ^= bytes[i];
    for (int bit = 0; bit < 8; ++bit) {
      remainder = (remainder & 1U) != 0 ? remainder >> 1 ^ kPolynomial : remainder >> 1;
    }
  }
  return static_cast<std::uint16_t>(remainder);
}

std::vector<std::uint8_t> to_bytes(const Packet& packet) {
  const Payload& payload = packet.payload;
  std::size_t size = payload.type.length;
  while (size > 1 && payload.bytes[size - 1] == 0) --size;  // the first byte always stays

  const std::uint32_t id = payload.type.id;
  std::vector<std::uint8_t> bytes = {kStart,
                                     static_cast<std::uint8_t>(size),
                                     0,  // flags: nothing that a receiver must understand
                                     0,  // flags: nothing that it may
                                     packet.sequence,
                                     packet.sender.system,
                                     packet.sender.component,
                                     static_cast<std::uint8_t>(id & 0xFFU),
                                     static_cast<std::uint8_t>(id >> 8 & 0xFFU),
                                     static_cast<std::uint8_t>(id >> 16 & 0xFFU)};
  bytes.reserve(kHeaderSize + size + kChecksumSize);
  bytes.insert(bytes.end(), payload.bytes.begin(), payload.bytes.begin() + static_cast<std::ptrdiff_t>(size));
  const std::uint16_t crc = packet_checksum(bytes.data(), size, payload.type);
  bytes.push_back(static_cast<std::uint8_t>(crc & 0xFFU));
  bytes.push_back(static_cast<std::uint8_t>(crc >> 8));
  return bytes;
}

std::vector<Packet> Parser::add(const std::uint8_t* bytes, std::size_t count) {
  waiting_.insert(waiting_.end(), bytes, bytes + count);
  std::vector<Packet> packets;
  std::size_t at = 0;
  while (at < waiting_.size()) {
    const Reading reading = read(waiting_.data() + at, waiting_.size() - at);
    if (reading.kind == Reading::Kind::incomplete) break;
    if (reading.kind == Reading::Kind::packet) packets.push_back(reading.packet);
    at += reading.size;
  }
  waiting_.erase(waiting_.begin(), waiting_.begin() + static_cast<std::ptrdiff_t>(at));
  return packets;
}

}  // namespace ear::mavlink
