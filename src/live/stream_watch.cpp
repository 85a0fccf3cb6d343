#include "src/live/stream_watch.h"

#include <array>
#include <cmath>
#include <utility>

#include "src/live/formatted.h"

namespace ear::live {
namespace {

constexpr double kSilence = 0.5;   // [s]
constexpr double kInterval = 0.4;  // [s] over which a rate is measured, at least
constexpr double kFlood = 3.0;     // times the rate in the calibration
constexpr double kSlow = 0.5;
constexpr double kNormal = 0.2;        // back to normal: the rate again, within this part
constexpr double kFewest = 10.0;       // [Hz] above this part of the calibration's rate, no fewer
constexpr double kClockWords = 10.0;   // [s] in which a clock that is set again and again has words for
constexpr int kMostClockWords = 3;     // so many times
constexpr TimeNs kStep = 250'000'000;  // a clock that goes this far ahead of ours or falls behind has been set

}  // namespace

StreamWatch::StreamWatch(std::string name, double rate_hz, TimeNs begin_ns)
    : name_(std::move(name)), expected_hz_(rate_hz), arrival_ns_(begin_ns), seen_ns_(begin_ns) {}

void StreamWatch::note(TimeNs t_ns, TimeNs now_ns) {
  const TimeNs delay = duration_ns(t_ns, now_ns);
  const TimeNs step = duration_ns(delay, delay_ns_);
  const bool waited = 2 * duration_ns(arrival_ns_, now_ns) > std::abs(step);  // the sample, or this process
  if (count_ > 0 && std::abs(step) > kStep && !waited) {
    step_ns_ = step;
    ++steps_;
  }
  delay_ns_ = delay;
  arrival_ns_ = now_ns;
  ++count_;
}

std::vector<std::string> StreamWatch::look(TimeNs now_ns) {
  std::vector<std::string> words;
  look_for_silence(now_ns, words);
  look_at_rate(now_ns, words);
  look_at_clock(now_ns, words);
  return words;
}

void StreamWatch::look_for_silence(TimeNs now_ns, std::vector<std::string>& words) {
  const double silence = seconds_between(arrival_ns_, now_ns);
  const bool slow_sensor = expected_hz_ > 0.0 && silence < 4.0 / expected_hz_;
  const bool silent = silence > kSilence && !slow_sensor;
  if (silent && !silent_) {
    words.push_back(count_ == 0 ? formatted("%s: nothing has come yet", name_.c_str())
                                : formatted("%s: silent for %.1f s", name_.c_str(), silence));
  }
  if (!silent && silent_) words.push_back(name_ + ": samples come");
  silent_ = silent;
}

void StreamWatch::look_at_rate(TimeNs now_ns, std::vector<std::string>& words) {
  const double interval = seconds_between(seen_ns_, now_ns);
  if (interval < kInterval) return;
  const std::uint64_t count = count_;
  const bool began = seen_ > 0 || count == 0;
  rate_hz_ = static_cast<double>(count - seen_) / interval;
  seen_ = count;
  seen_ns_ = now_ns;
  if (expected_hz_ <= 0.0 || silent_ || !began || rate_hz_ == 0.0) return;  // silence has words of its own
  const bool high = rate_hz_ > kFlood * expected_hz_ + kFewest;
  const bool few = rate_hz_ < kSlow * expected_hz_ && expected_hz_ > kFewest;
  const bool low = few && was_low_;  // twice in a row: else it only began or ended
  was_low_ = few;
  const Rate rate = high ? Rate::high : low ? Rate::low : Rate::right;
  const bool back = said_ != Rate::right && std::abs(rate_hz_ - expected_hz_) < kNormal * expected_hz_;
  if (rate != Rate::right && rate != said_) {
    words.push_back(formatted("%s: %.0f samples a second, where the calibration says %.0f%s", name_.c_str(), rate_hz_,
                              expected_hz_, high ? ": what the queues cannot hold is refused" : ""));
    said_ = rate;
  } else if (back) {
    words.push_back(formatted("%s: %.0f samples a second again", name_.c_str(), rate_hz_));
    said_ = Rate::right;
  }
}

void StreamWatch::look_at_clock(TimeNs now_ns, std::vector<std::string>& words) {
  const std::uint64_t steps = steps_;
  if (steps == seen_steps_) return;
  if (seconds_between(clock_words_.since_ns, now_ns) > kClockWords) clock_words_ = {now_ns, 0};
  if (clock_words_.count >= kMostClockWords) return;  // held back: the next time says how many there were
  ++clock_words_.count;
  words.push_back(formatted("%s: its clock was set by %+.3f s against this computer's", name_.c_str(),
                            1e-9 * static_cast<double>(step_ns_.load())));
  if (steps > seen_steps_ + 1)
    words.back() += formatted(", and %.0f times before", static_cast<double>(steps - seen_steps_ - 1));
  seen_steps_ = steps;
}

}  // namespace ear::live
