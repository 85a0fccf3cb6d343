// The threads that answer viewers: of bounded number, with a bounded queue, and behind the estimator in the machine's
// favour.
#pragma once

#include <httplib.h>

#include <condition_variable>
#include <cstddef>
#include <deque>
#include <functional>
#include <mutex>
#include <thread>
#include <vector>

namespace ear::view {

class Workers final : public httplib::TaskQueue {
 public:
  static constexpr std::size_t kThreads = 20;  ///< eight viewers, with two connections each, and some for newcomers
  static constexpr std::size_t kMostWaiting = 40;

  Workers();

  /// Runs it on another thread, or at once on this one where too many wait: Server then refuses the connection.
  void enqueue(std::function<void()> job) override;
  void shutdown() override;

 private:
  void run();

  std::mutex mutex_;
  std::condition_variable changed_;
  std::deque<std::function<void()>> jobs_;
  bool stopping_ = false;
  std::vector<std::thread> threads_;
};

/// The calling thread gets out of the others' way.
void lower_priority();

}  // namespace ear::view
