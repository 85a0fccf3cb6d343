// How far a long piece of work is, and how long it will take.
#pragma once

#include <chrono>
#include <mutex>
#include <string>

namespace ear::paper {

/// On a terminal one line that is rewritten, else a line every half minute. Callable from any thread.
class ProgressLog {
 public:
  /// `total` in any unit of which the work takes the same time each.
  ProgressLog(double total, std::size_t runs);

  /// This much more is done.
  void advance(double cost, const std::string& what);
  /// One run more is done.
  void finish_run(double cost, const std::string& what);
  /// Clears the line.
  void finish();

 private:
  using Clock = std::chrono::steady_clock;

  void show(const std::string& what);

  std::mutex mutex_;
  double total_;
  double done_ = 0.0;
  std::size_t runs_;
  std::size_t runs_done_ = 0;
  bool terminal_;
  Clock::time_point start_ = Clock::now();
  Clock::time_point shown_;
};

/// "3 h 20 min", "4 min", "40 s".
[[nodiscard]] std::string duration_text(double seconds);

}  // namespace ear::paper
