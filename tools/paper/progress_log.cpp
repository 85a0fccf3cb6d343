#include "tools/paper/progress_log.h"

#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <cstdio>

namespace ear::paper {

ProgressLog::ProgressLog(double total, std::size_t runs)
    : total_(total), runs_(runs), terminal_(isatty(STDERR_FILENO) == 1) {}

void ProgressLog::advance(double cost, const std::string& what) {
  const std::lock_guard<std::mutex> lock(mutex_);
  done_ += cost;
  show(what);
}

void ProgressLog::finish_run(double cost, const std::string& what) {
  const std::lock_guard<std::mutex> lock(mutex_);
  done_ += cost;
  ++runs_done_;
  show(what);
}

void ProgressLog::finish() {
  if (terminal_) std::fprintf(stderr, "\r\033[K");
}

void ProgressLog::show(const std::string& what) {
  const Clock::time_point now = Clock::now();
  const std::chrono::milliseconds interval(terminal_ ? 200 : 30'000);
  if (now - shown_ < interval) return;
  shown_ = now;
  const double elapsed = std::chrono::duration<double>(now - start_).count();
  const double left = elapsed * std::max(0.0, total_ - done_) / std::max(done_, 1e-9);
  std::fprintf(stderr, "%s%zu of %zu runs, about %s left: %s%s", terminal_ ? "\r\033[K" : "", runs_done_, runs_,
               duration_text(left).c_str(), what.c_str(), terminal_ ? "" : "\n");
  std::fflush(stderr);
}

std::string duration_text(double seconds) {
  if (seconds < 60.0) return std::to_string(std::lround(seconds)) + " s";
  const long minutes = std::lround(seconds / 60.0);
  if (minutes < 60) return std::to_string(minutes) + " min";
  return std::to_string(minutes / 60) + " h " + std::to_string(minutes % 60) + " min";
}

}  // namespace ear::paper
