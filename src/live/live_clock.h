// The clock of a live process: stamps of sensors that have no clock of their own, and the time of day for those that
// do.
#pragma once

#include <chrono>

#include "ear/types.h"

namespace ear::live {

/// The time of day when it was made, and on from there by the monotonic clock: it has no steps, whatever sets the
/// machine's clock. Any thread.
class LiveClock {
 public:
  LiveClock() : offset_ns_(wall_ns() - monotonic_ns()) {}

  /// [ns] since 1970.
  [[nodiscard]] TimeNs now() const { return monotonic_ns() + offset_ns_; }

  /// The same of a stamp of CLOCK_MONOTONIC, as drivers of cameras give it.
  [[nodiscard]] TimeNs from_monotonic(TimeNs t_ns) const { return t_ns + offset_ns_; }

  /// How far the machine's clock was set forward since [s]; minus: back.
  [[nodiscard]] double step() const { return seconds_between(now(), wall_ns()); }

 private:
  static TimeNs monotonic_ns() { return to_ns(std::chrono::steady_clock::now()); }
  static TimeNs wall_ns() { return to_ns(std::chrono::system_clock::now()); }
  template <typename Point>
  static TimeNs to_ns(Point point) {
    return std::chrono::duration_cast<std::chrono::nanoseconds>(point.time_since_epoch()).count();
  }

  TimeNs offset_ns_;
};

}  // namespace ear::live
