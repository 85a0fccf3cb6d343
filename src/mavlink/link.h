// The conversation with a flight controller: sends messages, a heartbeat once a second, and answers when asked for the
// time. The last two on a thread of its own, so that an answer does not wait for an image.
#pragma once

#include <atomic>
#include <chrono>
#include <cstdint>
#include <functional>
#include <mutex>
#include <string>
#include <thread>

#include "ear/types.h"
#include "src/mavlink/messages.h"
#include "src/mavlink/packet.h"
#include "src/mavlink/transport.h"

namespace ear::mavlink {

/// What a link did since it was opened.
struct LinkCounts {
  std::uint64_t odometry = 0;      ///< ODOMETRY messages sent
  std::uint64_t time_answers = 0;  ///< TIMESYNC requests answered
  std::uint64_t dropped = 0;       ///< messages that the line did not take, or that nothing was there to receive
};

/// What else a link does with what it receives; called by its thread.
struct LinkListener {
  std::function<void(const Packet&)> on_packet;  ///< each packet that came, after answers to it were sent
  bool asks_time = false;                        ///< sends a TIMESYNC request ten times a second
};

class Link {
 public:
  /// Opens `address` (see Transport) and begins. `clock` gives the time that ODOMETRY is stamped with, now [ns]; it is
  /// called from the thread.
  Link(const std::string& address, const Sender& sender, std::function<TimeNs()> clock, LinkListener listener = {});
  ~Link();
  Link(const Link&) = delete;
  Link& operator=(const Link&) = delete;
  Link(Link&&) = delete;
  Link& operator=(Link&&) = delete;

  void send(const OdometryMessage& message);
  void send(const StatusText& message);

  /// The state in the next heartbeats.
  void set_state(SystemState state) { state_ = state; }

  [[nodiscard]] LinkCounts counts() const;
  [[nodiscard]] std::uint16_t local_port() const { return transport_.local_port(); }

 private:
  bool send(const Payload& payload);  ///< mutex_ is held: packets of two threads must not mix
  void answer(const Packet& request);
  void ask_time();
  void converse();

  Transport transport_;
  Sender sender_;
  std::function<TimeNs()> clock_;
  LinkListener listener_;
  std::atomic<SystemState> state_ = SystemState::calibrating;
  std::atomic<bool> stop_ = false;

  mutable std::mutex mutex_;  ///< of what follows
  std::uint8_t sequence_ = 0;
  LinkCounts counts_;

  std::thread thread_;  ///< last: it uses all else
};

/// The answer to a request for the time, or nothing if it is none, or not for `self`.
[[nodiscard]] std::optional<TimeSync> answer_to(const Packet& packet, const Sender& self, TimeNs now_ns);

}  // namespace ear::mavlink
