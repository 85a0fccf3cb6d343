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
    : topics_(topics), lasers_(lasers), filled_(lasers.beams.size()) {}

void LaserMessages::take(const RawMessage& message, std::vector<LaserSample>& samples) {
  const auto topic = std::find(topics_.beams.begin(), topics_.beams.end(), message.topic);
  const auto beam = static_cast<std::size_t>(topic - topics_.beams.begin());
  if (beam >= filled_.size()) return;
  const Range range = range_message(message);
  const TimeNs t_ns = stamp_of(message, range.header);
  const bool same = !current_.range.empty() && std::abs(duration_ns(current_.t_ns, t_ns)) <= kSameTime;
  if (!current_.range.empty() && (!same || filled_[beam])) samples.push_back(*rest());
  if (current_.range.empty()) {
    current_.t_ns = t_ns;
    current_.range.assign(filled_.size(), std::numeric_limits<double>::quiet_NaN());
  }
  const double value = range_of(range.range);
  if (value >= lasers_.range_min && value <= lasers_.range_max) current_.range[beam] = value;
  filled_[beam] = true;
  if (std::all_of(filled_.begin(), filled_.end(), [](bool there) { return there; })) samples.push_back(*rest());
}

std::optional<LaserSample> LaserMessages::rest() {
  if (current_.range.empty()) return std::nullopt;
  filled_.assign(filled_.size(), false);
  return std::exchange(current_, {});
}

}  // namespace ear::ros2
