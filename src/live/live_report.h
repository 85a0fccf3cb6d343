// What the estimator's thread did last, for the thread that says so.
#pragma once

#include <atomic>
#include <cstdint>
#include <mutex>
#include <string>

#include "ear/odometry.h"
#include "src/live/live_estimator.h"

namespace ear::live {

class LiveReport {
 public:
  /// By the estimator's thread. Logs load steps.
  void take(const LiveFrame& frame, const Odometry& odometry);
  void take(const LiveSample& /*sample*/) { ++samples_; }

  /// By any thread: inertial samples so far; the health in words; at the end, what there was.
  [[nodiscard]] std::uint64_t samples() const { return samples_; }
  [[nodiscard]] std::string health() const;
  [[nodiscard]] std::string summary() const;

 private:
  mutable std::mutex mutex_;  ///< of what follows, up to the counter
  std::string health_ = "no frame yet";
  std::uint64_t frames_ = 0, estimates_ = 0;
  int load_step_ = 0;
  StreamCounts imu_;
  std::atomic<std::uint64_t> samples_{0};
};

}  // namespace ear::live
