// Words to systemd about the process: the datagrams of sd_notify(3).
#pragma once

#include <optional>
#include <string>

namespace ear::live {

class Notifier {
 public:
  /// To the socket that the environment's NOTIFY_SOCKET names; without one nothing is sent.
  Notifier();
  ~Notifier();
  Notifier(const Notifier&) = delete;
  Notifier& operator=(const Notifier&) = delete;
  Notifier(Notifier&&) = delete;
  Notifier& operator=(Notifier&&) = delete;

  void ready() { send("READY=1"); }
  void stopping() { send("STOPPING=1"); }
  void status(const std::string& text) { send("STATUS=" + text); }
  void alive() { send("WATCHDOG=1"); }

  /// How often alive() must be called [s], at least twice; nothing where systemd does not ask (WATCHDOG_USEC).
  [[nodiscard]] std::optional<double> watchdog() const { return watchdog_; }

 private:
  void send(const std::string& text);

  int socket_ = -1;
  std::string address_;  ///< an abstract one begins with a zero byte
  std::optional<double> watchdog_;
};

}  // namespace ear::live
