#include "src/view/connection.h"

#include <poll.h>
#include <sys/socket.h>

#include <algorithm>
#include <cerrno>
#include <cstdlib>

namespace ear::view {

using std::chrono::milliseconds;
using std::chrono::steady_clock;

bool Connection::ready(short events, Time deadline) const {
  while (true) {
    const auto left = std::chrono::duration_cast<milliseconds>(deadline - steady_clock::now()).count();
    if (left < 0) return false;
    pollfd wanted{socket_, events, 0};
    const int found = poll(&wanted, 1, static_cast<int>(left));
    if (found >= 0 || errno != EINTR) return found > 0;
  }
}

bool Connection::wait_for_request(milliseconds longest, const std::function<bool()>& go_on) {
  constexpr milliseconds kSlice{100};
  const Time deadline = steady_clock::now() + longest;
  while (begin_ == end_ && !ready(POLLIN, std::min(deadline, steady_clock::now() + kSlice))) {
    if (!go_on() || steady_clock::now() >= deadline) return false;
  }
  request_bytes_ = 0;
  status_ = 0;
  read_deadline_ = steady_clock::now() + kLongestRead;
  return true;
}

ssize_t Connection::read(char* to, std::size_t size) {
  if (begin_ == end_) {
    if (!ready(POLLIN, read_deadline_)) return -1;
    const ssize_t got = recv(socket_, buffer_.data(), buffer_.size(), MSG_DONTWAIT);
    if (got <= 0) return got;
    begin_ = 0;
    end_ = static_cast<std::size_t>(got);
  }
  const std::size_t count = std::min(size, end_ - begin_);
  request_bytes_ += count;
  if (request_bytes_ > kMostRequestBytes) return -1;
  std::copy_n(buffer_.data() + begin_, count, to);
  begin_ += count;
  return static_cast<ssize_t>(count);
}

ssize_t Connection::write(const char* from, std::size_t size) {
  if (status_ == 0) {  // "HTTP/1.1 200 OK": the answer begins
    constexpr std::size_t kStatusAt = 9;
    if (size >= kStatusAt + 3) status_ = std::atoi(std::string(from + kStatusAt, 3).c_str());
    write_deadline_ = steady_clock::now() + kLongestWrite;
  }
  std::size_t sent = 0;
  while (sent < size) {
    if (!ready(POLLOUT, write_deadline_)) {
      too_slow_ = true;
      return -1;
    }
    const ssize_t count = send(socket_, from + sent, size - sent, MSG_DONTWAIT | MSG_NOSIGNAL);
    if (count < 0 && (errno == EAGAIN || errno == EINTR)) continue;
    if (count <= 0) return -1;
    sent += static_cast<std::size_t>(count);
  }
  return static_cast<ssize_t>(sent);
}

// Nobody asks who is there: viewers are told apart by what they say.
void Connection::get_remote_ip_and_port(std::string& ip, int& port) const {
  ip.clear();
  port = 0;
}
void Connection::get_local_ip_and_port(std::string& ip, int& port) const { get_remote_ip_and_port(ip, port); }

}  // namespace ear::view
