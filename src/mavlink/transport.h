// Bytes to and from a flight controller: UDP or a serial line. Sending never waits. One thread may send while another
// receives.
#pragma once

#include <sys/socket.h>

#include <cstddef>
#include <cstdint>
#include <mutex>
#include <string>
#include <vector>

namespace ear::mavlink {

class Transport {
 public:
  /// Opens an address:
  ///   udp:HOST:PORT       sends there, from a port of its own
  ///   udpin:HOST:PORT     listens there, and answers whoever spoke last; until then it sends nothing
  ///   serial:DEVICE:BAUD  8 bits, no parity, one stop bit, no flow control
  /// Throws std::invalid_argument for an address that is none of these, std::system_error if it cannot be opened.
  explicit Transport(const std::string& address);
  ~Transport();
  Transport(const Transport&) = delete;
  Transport& operator=(const Transport&) = delete;
  Transport(Transport&&) = delete;
  Transport& operator=(Transport&&) = delete;

  /// False if the bytes could not be taken at once, or nothing is there to receive them.
  bool send(const std::vector<std::uint8_t>& bytes);

  /// Waits until something comes, at most `timeout_ms`. The number of bytes in `bytes`.
  [[nodiscard]] std::size_t receive(std::uint8_t* bytes, std::size_t capacity, int timeout_ms);

  /// The UDP port that listens here.
  [[nodiscard]] std::uint16_t local_port() const;

 private:
  int file_ = -1;
  bool listens_ = false;  ///< udpin: the peer is whoever spoke last; else the file itself knows
  std::mutex peer_mutex_;
  sockaddr_storage peer_{};
  socklen_t peer_length_ = 0;  ///< 0: nothing came from there yet
};

}  // namespace ear::mavlink
