#include "src/mavlink/transport.h"

#include <fcntl.h>
#include <netdb.h>
#include <poll.h>
#include <termios.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <memory>
#include <stdexcept>
#include <system_error>
#include <utility>

namespace ear::mavlink {
namespace {

struct Address {
  std::string scheme;
  std::string place;   ///< host or device
  std::string detail;  ///< port or baud rate
};

Address parse(const std::string& text) {
  const std::size_t first = text.find(':');
  const std::size_t last = text.rfind(':');
  if (first == last || first + 1 == last || last + 1 == text.size()) {  // also where there is none
    throw std::invalid_argument("'" + text + "' is not udp:HOST:PORT, udpin:HOST:PORT or serial:DEVICE:BAUD");
  }
  return {text.substr(0, first), text.substr(first + 1, last - first - 1), text.substr(last + 1)};
}

[[noreturn]] void fail(const std::string& what) { throw std::system_error(errno, std::generic_category(), what); }

/// Closes a file unless it is released before.
class FileGuard {
 public:
  explicit FileGuard(int file) : file_(file) {}
  ~FileGuard() {
    if (file_ >= 0) ::close(file_);
  }
  FileGuard(const FileGuard&) = delete;
  FileGuard& operator=(const FileGuard&) = delete;
  FileGuard(FileGuard&&) = delete;
  FileGuard& operator=(FileGuard&&) = delete;

  [[nodiscard]] int get() const { return file_; }
  int release() { return std::exchange(file_, -1); }

 private:
  int file_;
};

int open_udp(const Address& address, bool listen) {
  addrinfo hints{};
  hints.ai_socktype = SOCK_DGRAM;
  hints.ai_flags = AI_NUMERICSERV | (listen ? AI_PASSIVE : 0);
  addrinfo* found = nullptr;
  if (const int error = ::getaddrinfo(address.place.c_str(), address.detail.c_str(), &hints, &found); error != 0) {
    throw std::invalid_argument("'" + address.place + ":" + address.detail + "': " + ::gai_strerror(error));
  }
  const std::unique_ptr<addrinfo, decltype(&::freeaddrinfo)> owner(found, &::freeaddrinfo);

  FileGuard file(::socket(found->ai_family, SOCK_DGRAM | SOCK_NONBLOCK | SOCK_CLOEXEC, 0));
  const auto attach = listen ? &::bind : &::connect;
  if (file.get() < 0 || attach(file.get(), found->ai_addr, found->ai_addrlen) != 0) {
    fail(address.place + ":" + address.detail);
  }
  return file.release();
}

speed_t baud_constant(const std::string& baud) {
  static constexpr std::array<std::pair<const char*, speed_t>, 13> kRates = {{{"9600", B9600},
                                                                              {"19200", B19200},
                                                                              {"38400", B38400},
                                                                              {"57600", B57600},
                                                                              {"115200", B115200},
                                                                              {"230400", B230400},
                                                                              {"460800", B460800},
                                                                              {"500000", B500000},
                                                                              {"921600", B921600},
                                                                              {"1000000", B1000000},
                                                                              {"1500000", B1500000},
                                                                              {"2000000", B2000000},
                                                                              {"3000000", B3000000}}};
  std::string known;
  for (const auto& [name, constant] : kRates) {
    if (baud == name) return constant;
    known += std::string(known.empty() ? "" : ", ") + name;
  }
  throw std::invalid_argument("'" + baud + "' is not a baud rate: " + known);
}

int open_serial(const Address& address) {
  const speed_t speed = baud_constant(address.detail);
  FileGuard file(::open(address.place.c_str(), O_RDWR | O_NOCTTY | O_NONBLOCK | O_CLOEXEC));
  termios settings{};
  if (file.get() < 0 || ::tcgetattr(file.get(), &settings) != 0) fail(address.place);
  ::cfmakeraw(&settings);
  settings.c_cflag |= CLOCAL | CREAD;
  settings.c_cflag &= ~static_cast<tcflag_t>(CRTSCTS | CSTOPB);
  ::cfsetispeed(&settings, speed);
  ::cfsetospeed(&settings, speed);
  if (::tcsetattr(file.get(), TCSANOW, &settings) != 0) fail(address.place);
  return file.release();
}

}  // namespace

Transport::Transport(const std::string& text) {
  const Address address = parse(text);
  if (address.scheme == "serial") {
    file_ = open_serial(address);
  } else if (address.scheme == "udp" || address.scheme == "udpin") {
    listens_ = address.scheme == "udpin";
    file_ = open_udp(address, listens_);
  } else {
    throw std::invalid_argument("'" + address.scheme + "' is not udp, udpin or serial");
  }
}

Transport::~Transport() { ::close(file_); }

bool Transport::send(const std::vector<std::uint8_t>& bytes) {
  ssize_t sent = 0;
  if (listens_) {
    const std::lock_guard lock(peer_mutex_);
    if (peer_length_ == 0) return false;
    sent = ::sendto(file_, bytes.data(), bytes.size(), 0, reinterpret_cast<const sockaddr*>(&peer_), peer_length_);
  } else {
    sent = ::write(file_, bytes.data(), bytes.size());
  }
  return sent == static_cast<ssize_t>(bytes.size());
}

std::size_t Transport::receive(std::uint8_t* bytes, std::size_t capacity, int timeout_ms) {
  pollfd waiting{file_, POLLIN, 0};
  if (::poll(&waiting, 1, timeout_ms) <= 0) return 0;
  if ((waiting.revents & POLLIN) == 0) {  // the line is gone: no reason to ask again at once
    ::poll(nullptr, 0, timeout_ms);
    return 0;
  }
  sockaddr_storage sender{};
  socklen_t length = sizeof(sender);
  const ssize_t count = listens_ ? ::recvfrom(file_, bytes, capacity, 0, reinterpret_cast<sockaddr*>(&sender), &length)
                                 : ::read(file_, bytes, capacity);
  if (count <= 0) return 0;
  if (listens_) {
    const std::lock_guard lock(peer_mutex_);
    peer_ = sender;
    peer_length_ = length;
  }
  return static_cast<std::size_t>(count);
}

std::uint16_t Transport::local_port() const {
  sockaddr_storage here{};
  socklen_t length = sizeof(here);
  std::array<char, NI_MAXSERV> port{};
  if (::getsockname(file_, reinterpret_cast<sockaddr*>(&here), &length) != 0) return 0;
  if (::getnameinfo(reinterpret_cast<const sockaddr*>(&here), length, nullptr, 0, port.data(), port.size(),
                    NI_NUMERICSERV | NI_DGRAM) != 0) {
    return 0;
  }
  return static_cast<std::uint16_t>(std::stoi(port.data()));
}

}  // namespace ear::mavlink
