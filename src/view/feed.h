// From the estimator's thread to the view: what it offers is taken at 10 Hz at most and made ready on another thread.
#pragma once

#include <atomic>
#include <chrono>
#include <condition_variable>
#include <cstdint>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <thread>
#include <vector>

#include "src/view/history.h"
#include "src/view/moment.h"

namespace ear::view {

/// The estimator's thread never waits here: a moment that comes while the one before is still being made ready is
/// dropped and counted.
class Feed {
 public:
  static constexpr std::chrono::milliseconds kInterval{100};

  explicit Feed(const Description& description);
  ~Feed();
  Feed(const Feed&) = delete;
  Feed& operator=(const Feed&) = delete;
  Feed(Feed&&) = delete;
  Feed& operator=(Feed&&) = delete;

  /// Is it time for another moment? Ask before making one.
  [[nodiscard]] bool due() const;
  /// Takes a moment, or drops it. On the thread that asks due().
  void offer(Moment moment);

  /// Nothing comes any more: waits until what was offered is ready, and marks the run as ended.
  void finish();

  [[nodiscard]] const History& history() const { return history_; }
  [[nodiscard]] const std::string& description() const { return description_; }
  [[nodiscard]] bool ended() const { return ended_; }
  [[nodiscard]] std::uint64_t dropped() const { return dropped_; }

 private:
  void run();
  void keep(const Moment& moment);

  std::string description_;
  std::vector<CameraCalibration> cameras_;
  History history_;
  std::chrono::steady_clock::time_point next_{};  ///< when the next moment is due
  std::mutex mutex_;
  std::condition_variable changed_;
  std::optional<Moment> waiting_;
  bool busy_ = false;
  bool stopping_ = false;
  std::atomic<bool> ended_ = false;
  std::atomic<std::uint64_t> dropped_ = 0;
  std::thread thread_;  ///< last: it uses all of the above
};

}  // namespace ear::view
