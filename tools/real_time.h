// The clock of a recording that is played as fast as it was made.
#pragma once

#include <algorithm>
#include <chrono>
#include <thread>

#include "ear/types.h"

namespace ear::tools {

/// Runs from its construction on. now() may be called from any thread.
class RealTimeClock {
 public:
  /// It shows `start_ns` now.
  explicit RealTimeClock(TimeNs start_ns) : start_ns_(start_ns) {}

  [[nodiscard]] TimeNs now() const {
    return start_ns_ + std::chrono::nanoseconds(std::chrono::steady_clock::now() - start_).count();
  }

  /// Returns when the clock shows `t_ns`, at once if it does already.
  void wait_until(TimeNs t_ns) {
    latest_ = std::max(latest_, seconds_between(t_ns, now()));
    std::this_thread::sleep_until(start_ + std::chrono::nanoseconds(t_ns - start_ns_));
  }

  /// How far behind a call of wait_until() was at worst [s].
  [[nodiscard]] double latest() const { return latest_; }

 private:
  TimeNs start_ns_;
  std::chrono::steady_clock::time_point start_ = std::chrono::steady_clock::now();
  double latest_ = 0.0;
};

}  // namespace ear::tools
