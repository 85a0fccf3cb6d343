#include "src/mavlink/link.h"

#include <algorithm>
#include <array>
#include <utility>

namespace ear::mavlink {
namespace {

using SteadyClock = std::chrono::steady_clock;
constexpr std::chrono::milliseconds kHeartbeatInterval{1000};
constexpr std::chrono::milliseconds kQuestionInterval{100};
constexpr int kPatienceMs = 50;  // how long the thread waits for bytes before it looks at the time

}  // namespace

std::optional<TimeSync> answer_to(const Packet& packet, const Sender& self, TimeNs now_ns) {
  const std::optional<TimeSync> request = to_time_sync(packet.payload);
  if (!request || request->tc1 != 0) return std::nullopt;  // not a request, but the answer of another system
  const bool for_us = (request->target_system == 0 || request->target_system == self.system) &&
                      (request->target_component == 0 || request->target_component == self.component);
  if (!for_us) return std::nullopt;
  return TimeSync{std::max<TimeNs>(now_ns, 1), request->ts1, packet.sender.system, packet.sender.component};
}

Link::Link(const std::string& address, const Sender& sender, std::function<TimeNs()> clock, LinkListener listener)
    : transport_(address), sender_(sender), clock_(std::move(clock)), listener_(std::move(listener)), thread_([this] {
        converse();
      }) {}

Link::~Link() {
  stop_ = true;
  thread_.join();
}

void Link::send(const OdometryMessage& message) {
  const std::lock_guard lock(mutex_);
  if (send(to_payload(message))) ++counts_.odometry;
}

void Link::send(const StatusText& message) {
  const std::lock_guard lock(mutex_);
  send(to_payload(message));
}

LinkCounts Link::counts() const {
  const std::lock_guard lock(mutex_);
  return counts_;
}

bool Link::send(const Payload& payload) {
  const bool sent = transport_.send(to_bytes({sender_, sequence_++, payload}));
  if (!sent) ++counts_.dropped;
  return sent;
}

void Link::answer(const Packet& request) {
  const std::lock_guard lock(mutex_);  // before the time is read, which shall be that of sending
  const std::optional<TimeSync> reply = answer_to(request, sender_, clock_());
  if (reply && send(to_payload(*reply))) ++counts_.time_answers;
}

void Link::ask_time() {
  const std::lock_guard lock(mutex_);
  send(to_payload(TimeSync{0, clock_(), 0, 0}));
}

void Link::converse() {
  Parser parser;
  std::array<std::uint8_t, 1024> bytes{};
  SteadyClock::time_point next_heartbeat = SteadyClock::now();
  SteadyClock::time_point next_question = next_heartbeat;
  while (!stop_) {
    if (SteadyClock::now() >= next_heartbeat) {
      const std::lock_guard lock(mutex_);
      send(to_payload(Heartbeat{state_}));
      next_heartbeat += kHeartbeatInterval;
    }
    if (listener_.asks_time && SteadyClock::now() >= next_question) {
      ask_time();
      next_question = SteadyClock::now() + kQuestionInterval;
    }
    const std::size_t count = transport_.receive(bytes.data(), bytes.size(), kPatienceMs);
    for (const Packet& packet : parser.add(bytes.data(), count)) {
      answer(packet);
      if (listener_.on_packet) listener_.on_packet(packet);
    }
  }
}

}  // namespace ear::mavlink
