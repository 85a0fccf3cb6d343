#include "src/ros2/laser_messages.h"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <limits>
#include <utility>

namespace ear::ros2 {
namespace {

constexpr TimeNs kSameTime = 10'000'000;
constexpr TimeNs kSilent = 500'000'000;
constexpr std::size_t kMostPending = 64;

}  // namespace

double range_of(float range) {
  if (!std::isfinite(range)) return std::numeric_limits<double>::quiet_NaN();
  std::array<char, 32> text{};
  const auto end = std::to_chars(text.data(), text.data() + text.size(), range).ptr;
  double value = 0.0;
  std::from_chars(text.data(), end, value);
  return value;
}

Range range_message(const RawMessage& message) {
  if (canonical_type(message.type) != LaserScan::kType) return decode<Range>(message);
  auto scan = decode<LaserScan>(message);
  if (scan.ranges.size() != 1) {
    throw InputError(message.topic + ": " + std::to_string(scan.ranges.size()) + " ranges; a laser has one beam");
  }
  Range range;
  range.header = std::move(scan.header);
  range.min_range = scan.range_min;
  range.max_range = scan.range_max;
  range.range = scan.ranges[0];
  return range;
}

LaserMessages::LaserMessages(const SensorTopics& topics, const LaserCalibration& lasers)
    : topics_(topics), lasers_(lasers) {}

void LaserMessages::take(const RawMessage& message, std::vector<LaserSample>& samples) {
  const auto topic = std::find(topics_.beams.begin(), topics_.beams.end(), message.topic);
  const auto beam = static_cast<std::size_t>(topic - topics_.beams.begin());
  if (beam >= lasers_.beams.size()) return;
  const Range range = range_message(message);
  const TimeNs t_ns = stamp_of(message, range.header);
  if (last_ns_.empty()) last_ns_.assign(lasers_.beams.size(), t_ns);
  last_ns_[beam] = latest_ns_ = t_ns;

  Pending& pending = pending_at(t_ns, beam);
  const double value = range_of(range.range);
  if (value >= lasers_.range_min && value <= lasers_.range_max) pending.sample.range[beam] = value;
  pending.there[beam] = true;
  while (!pending_.empty() && (is_done(pending_.front()) || pending_.size() > kMostPending)) {
    samples.push_back(std::move(pending_.front().sample));
    pending_.pop_front();
  }
}

void LaserMessages::finish(std::vector<LaserSample>& samples) {
  for (Pending& pending : pending_) samples.push_back(std::move(pending.sample));
  pending_.clear();
}

/// The reading at `t_ns` that lacks this beam; a new one if there is none.
LaserMessages::Pending& LaserMessages::pending_at(TimeNs t_ns, std::size_t beam) {
  const auto lacks = [&](const Pending& pending) {
    return std::abs(duration_ns(pending.sample.t_ns, t_ns)) <= kSameTime && !pending.there[beam];
  };
  const auto found = std::find_if(pending_.begin(), pending_.end(), lacks);
  if (found != pending_.end()) return *found;
  const auto later = [&](const Pending& pending) { return pending.sample.t_ns > t_ns; };
  const std::size_t beams = lasers_.beams.size();
  const std::vector<double> nothing(beams, std::numeric_limits<double>::quiet_NaN());
  return *pending_.insert(std::find_if(pending_.begin(), pending_.end(), later),
                          Pending{LaserSample{t_ns, nothing}, std::vector<bool>(beams, false)});
}

bool LaserMessages::is_done(const Pending& pending) const {
  for (std::size_t beam = 0; beam < pending.there.size(); ++beam) {
    const bool passed = duration_ns(pending.sample.t_ns, last_ns_[beam]) > kSameTime;
    const bool silent = std::abs(duration_ns(last_ns_[beam], latest_ns_)) > kSilent;
    if (!pending.there[beam] && !passed && !silent) return false;
  }
  return true;
}

}  // namespace ear::ros2
