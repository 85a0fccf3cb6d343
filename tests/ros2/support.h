// Messages made for tests.
#pragma once

#include <string>
#include <vector>

#include <doctest/doctest.h>
#include "src/ros2/raw_message.h"

namespace ear::test {

/// A message's bytes with what RawMessage borrows.
template <typename Message>
class Sent {
 public:
  Sent(const std::string& topic, const Message& message, TimeNs received_ns = 0)
      : bytes_(ros2::encode(message)), raw_{topic, Message::kType, received_ns, {bytes_.data(), bytes_.size()}} {}
  Sent(const Sent&) = delete;
  Sent& operator=(const Sent&) = delete;
  Sent(Sent&&) = delete;
  Sent& operator=(Sent&&) = delete;
  ~Sent() = default;
  operator const ros2::RawMessage&() const { return raw_; }  // NOLINT(google-explicit-constructor): reads as one

 private:
  std::vector<std::uint8_t> bytes_;
  ros2::RawMessage raw_;
};

inline ros2::Header header(TimeNs t_ns, const std::string& frame = "") { return {ros2::time_of_stamp(t_ns), frame}; }

}  // namespace ear::test
