#include "src/live/notify.h"

#include <doctest/doctest.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>

#include <array>
#include <cstdlib>
#include <cstring>

using namespace ear::live;

namespace {

/// What systemd would be.
class Manager {
 public:
  explicit Manager(const std::string& path) : path_(path), socket_(::socket(AF_UNIX, SOCK_DGRAM, 0)) {
    sockaddr_un address{};
    address.sun_family = AF_UNIX;
    std::strncpy(address.sun_path, path.c_str(), sizeof(address.sun_path) - 1);
    REQUIRE(::bind(socket_, reinterpret_cast<const sockaddr*>(&address), sizeof(address)) == 0);
  }
  ~Manager() {
    ::close(socket_);
    ::unlink(path_.c_str());
  }
  Manager(const Manager&) = delete;
  Manager& operator=(const Manager&) = delete;
  Manager(Manager&&) = delete;
  Manager& operator=(Manager&&) = delete;

  std::string hears() {
    std::array<char, 200> text{};
    const ssize_t length = ::recv(socket_, text.data(), text.size(), MSG_DONTWAIT);
    return {text.data(), static_cast<std::size_t>(length > 0 ? length : 0)};
  }

 private:
  std::string path_;
  int socket_;
};

}  // namespace

TEST_CASE("notify: the datagrams of sd_notify") {
  const std::string path = "/tmp/ear-notify-" + std::to_string(::getpid());
  Manager manager(path);
  ::setenv("NOTIFY_SOCKET", path.c_str(), 1);
  ::setenv("WATCHDOG_USEC", "4000000", 1);
  ::unsetenv("WATCHDOG_PID");
  Notifier notifier;
  CHECK(notifier.watchdog() == doctest::Approx(4.0));
  notifier.ready();
  CHECK(manager.hears() == "READY=1");
  notifier.status("tracking; imu 200 Hz");
  CHECK(manager.hears() == "STATUS=tracking; imu 200 Hz");
  notifier.alive();
  CHECK(manager.hears() == "WATCHDOG=1");
  notifier.stopping();
  CHECK(manager.hears() == "STOPPING=1");
  ::setenv("WATCHDOG_PID", "1", 1);  // another process is watched
  CHECK_FALSE(Notifier{}.watchdog());
  ::unsetenv("NOTIFY_SOCKET");
  Notifier nobody;
  nobody.ready();
  CHECK(manager.hears().empty());
}
