// For messages that come again and again: one of a kind per interval.
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <string>

#include "ear/types.h"

namespace ear {

class RepeatLimit {
 public:
  /// `interval` [s], of the times that allows() is given.
  explicit RepeatLimit(double interval) : interval_(interval) {}

  /// Nothing: hold this message back. Else: write it, and so many of its kind were held back since the one before.
  std::optional<std::uint64_t> allows(const std::string& kind, TimeNs t_ns) {
    const auto [entry, first] = entries_.try_emplace(kind, Entry{t_ns, 0});
    if (!first && t_ns >= entry->second.last_ns && seconds_between(entry->second.last_ns, t_ns) < interval_) {
      ++entry->second.held_back;
      return std::nullopt;
    }
    const std::uint64_t held_back = entry->second.held_back;
    entry->second = {t_ns, 0};
    return held_back;
  }

 private:
  struct Entry {
    TimeNs last_ns = 0;
    std::uint64_t held_back = 0;
  };

  double interval_;
  std::map<std::string, Entry> entries_;
};

/// "", or " (7 more were not written)", for the end of a message.
[[nodiscard]] inline std::string held_back_text(std::uint64_t count) {
  return count == 0 ? "" : " (" + std::to_string(count) + " more were not written)";
}

}  // namespace ear
