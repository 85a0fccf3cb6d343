// One sensor's stream, looked at from outside: is it there, at its rate, with a clock that runs evenly?
#pragma once

#include <atomic>
#include <cstdint>
#include <string>
#include <vector>

#include "ear/types.h"

namespace ear::live {

/// The sensor's thread notes each sample, another one asks now and then what there is to say. Neither waits.
class StreamWatch {
 public:
  /// `rate_hz` as the calibration says; `begin_ns`: the time from which samples are missed.
  StreamWatch(std::string name, double rate_hz, TimeNs begin_ns);

  /// By the sensor's thread: a sample with this stamp came at `now_ns`.
  void note(TimeNs t_ns, TimeNs now_ns);

  /// By one other thread, a few times a second: what changed since it asked last, in words, such as "imu: silent for
  /// 0.6 s".
  [[nodiscard]] std::vector<std::string> look(TimeNs now_ns);

  /// [Hz] in the last second or so; of the same thread.
  [[nodiscard]] double rate_hz() const { return rate_hz_; }
  [[nodiscard]] bool silent() const { return silent_; }
  [[nodiscard]] const std::string& name() const { return name_; }
  [[nodiscard]] std::uint64_t count() const { return count_; }

 private:
  void look_for_silence(TimeNs now_ns, std::vector<std::string>& words);
  void look_at_rate(TimeNs now_ns, std::vector<std::string>& words);
  void look_at_clock(TimeNs now_ns, std::vector<std::string>& words);

  std::string name_;
  double expected_hz_;
  std::atomic<std::uint64_t> count_{0};
  std::atomic<TimeNs> arrival_ns_;       ///< of the newest
  std::atomic<TimeNs> step_ns_{0};       ///< the last step of its clock against ours
  std::atomic<std::uint64_t> steps_{0};  ///< how many there were
  TimeNs delay_ns_ = 0;                  ///< the sensor's thread: of the newest, in our clock

  // Of the thread that looks.
  std::uint64_t seen_ = 0, seen_steps_ = 0;
  TimeNs seen_ns_;
  struct ClockWords {
    TimeNs since_ns = 0;
    int count = 0;
  } clock_words_;
  double rate_hz_ = 0.0;
  bool silent_ = false, was_low_ = false;
  enum class Rate { right, high, low } said_ = Rate::right;
};

}  // namespace ear::live
