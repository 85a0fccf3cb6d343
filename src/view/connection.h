// One connection of a viewer, within bounds of bytes and time: a slow, silent or hostile peer is cut off.
#pragma once

#include <httplib.h>

#include <array>
#include <chrono>
#include <cstddef>
#include <functional>
#include <string>

namespace ear::view {

/// The bytes of one socket, for httplib. It does not own the socket.
class Connection final : public httplib::Stream {
 public:
  static constexpr std::size_t kMostRequestBytes = 16'384;
  static constexpr std::chrono::milliseconds kLongestRead{2000};   ///< from a request's first byte to its last
  static constexpr std::chrono::milliseconds kLongestWrite{2000};  ///< of a whole answer

  explicit Connection(socket_t socket) : socket_(socket) {}

  /// Waits for the first byte of a request, while `go_on` says so. False: it does not come within `longest`.
  [[nodiscard]] bool wait_for_request(std::chrono::milliseconds longest, const std::function<bool()>& go_on);

  /// Of the last answer; 0: none was begun.
  [[nodiscard]] int status() const { return status_; }
  /// The last answer could not be written in time.
  [[nodiscard]] bool too_slow() const { return too_slow_; }

  [[nodiscard]] bool is_readable() const override { return true; }
  [[nodiscard]] bool is_writable() const override { return !too_slow_; }
  ssize_t read(char* to, std::size_t size) override;
  ssize_t write(const char* from, std::size_t size) override;
  void get_remote_ip_and_port(std::string& ip, int& port) const override;
  void get_local_ip_and_port(std::string& ip, int& port) const override;
  [[nodiscard]] socket_t socket() const override { return socket_; }

 private:
  using Time = std::chrono::steady_clock::time_point;
  [[nodiscard]] bool ready(short events, Time deadline) const;

  socket_t socket_;
  std::array<char, 4096> buffer_{};
  std::size_t begin_ = 0, end_ = 0;  ///< of what was received and not read yet
  std::size_t request_bytes_ = 0;
  Time read_deadline_{}, write_deadline_{};
  int status_ = 0;
  bool too_slow_ = false;
};

}  // namespace ear::view
