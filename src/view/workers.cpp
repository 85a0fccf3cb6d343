#include "src/view/workers.h"

#include <sys/resource.h>

#include <utility>

namespace ear::view {

void lower_priority() {
  constexpr int kNice = 10;
  setpriority(PRIO_PROCESS, 0, kNice);  // of the thread, on Linux; where that fails, all is as before
}

Workers::Workers() {
  for (std::size_t i = 0; i < kThreads; ++i) threads_.emplace_back([this] { run(); });
}

void Workers::enqueue(std::function<void()> job) {
  {
    const std::lock_guard lock(mutex_);
    if (jobs_.size() < kMostWaiting) {
      jobs_.push_back(std::move(job));
      job = nullptr;
    }
  }
  if (job) return job();
  changed_.notify_one();
}

void Workers::shutdown() {
  {
    const std::lock_guard lock(mutex_);
    stopping_ = true;
  }
  changed_.notify_all();
  for (std::thread& thread : threads_) thread.join();
}

void Workers::run() {
  lower_priority();
  while (true) {
    std::function<void()> job;
    {
      std::unique_lock lock(mutex_);
      changed_.wait(lock, [this] { return !jobs_.empty() || stopping_; });
      if (jobs_.empty()) return;
      job = std::move(jobs_.front());
      jobs_.pop_front();
    }
    job();
  }
}

}  // namespace ear::view
