#include "src/recording/stream_timing.h"

#include <algorithm>
#include <cmath>

namespace ear {
namespace {

constexpr double kGapPeriods = 3.0;

double median(std::vector<float> values) {
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return static_cast<double>(*middle);
}

}  // namespace

void StreamTiming::add(TimeNs t_ns) {
  if (count_ == 0) {
    first_ns_ = t_ns;
  } else {
    intervals_.push_back(static_cast<float>(seconds_between(last_ns_, t_ns)));
  }
  last_ns_ = t_ns;
  ++count_;
}

TimingReport StreamTiming::report() const {
  TimingReport report;
  report.count = count_;
  report.first_ns = first_ns_;
  report.last_ns = last_ns_;
  if (intervals_.empty()) return report;

  const double period = median(intervals_);
  report.rate_hz = 1.0 / period;
  double sum = 0.0;
  double sum_of_squares = 0.0;
  for (const float interval : intervals_) {
    const double deviation = static_cast<double>(interval) - period;
    report.longest_gap = std::max(report.longest_gap, static_cast<double>(interval));
    if (static_cast<double>(interval) > kGapPeriods * period) {
      ++report.gaps;
    } else {
      sum += deviation;
      sum_of_squares += deviation * deviation;
    }
  }
  const auto regular = static_cast<double>(std::max<std::size_t>(1, intervals_.size() - report.gaps));
  const double mean = sum / regular;
  report.jitter_s = std::sqrt(std::max(0.0, sum_of_squares / regular - mean * mean));
  return report;
}

}  // namespace ear
