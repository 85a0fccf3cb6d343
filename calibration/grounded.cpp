#include "calibration/grounded.h"

#include <algorithm>
#include <cmath>
#include <optional>

namespace ear::calibration {
namespace {

constexpr double kLonger = 0.06;           // [m] than on the ground
constexpr double kOnGround = 0.3;          // share of the drive
constexpr TimeNs kMargin = 1'000'000'000;  // [ns] around what is off the ground: a take-off begins gently

/// Of all beams. Nothing where half of them or more have no return.
std::optional<double> mean_range(const LaserSample& sample, const LaserCalibration& lasers) {
  double sum = 0.0;
  std::size_t count = 0;
  for (const double range : sample.range) {
    if (!(range >= lasers.range_min && range <= lasers.range_max)) continue;
    sum += range;
    ++count;
  }
  if (2 * count <= sample.range.size()) return std::nullopt;
  return sum / static_cast<double>(count);
}

void mark_off(Segment& segment, TimeNs from_ns, TimeNs to_ns) {
  auto& keyframes = segment.keyframes;
  for (std::size_t i = 0; i < keyframes.size(); ++i) {
    const TimeNs next_ns = i + 1 < keyframes.size() ? keyframes[i + 1].t_ns : keyframes[i].t_ns;
    if (keyframes[i].t_ns <= to_ns && next_ns >= from_ns) keyframes[i].on_ground = false;
  }
}

}  // namespace

void mark_ground(Segment& segment, const LaserCalibration& lasers) {
  std::vector<double> ranges;
  for (const LaserSample& sample : segment.drive->lasers) {
    if (const auto range = mean_range(sample, lasers)) ranges.push_back(*range);
  }
  if (ranges.empty()) return;
  const auto level = ranges.begin() + static_cast<std::ptrdiff_t>(kOnGround * static_cast<double>(ranges.size()));
  std::nth_element(ranges.begin(), level, ranges.end());
  bool off = false;
  TimeNs since_ns = 0;
  TimeNs last_ns = 0;
  int odd = 0;  // readings in a row: a single one meets a passer-by
  for (const LaserSample& sample : segment.drive->lasers) {
    const TimeNs t_ns = later_by(lasers.time_offset, sample.t_ns);
    const auto range = mean_range(sample, lasers);
    odd = !range || *range > *level + kLonger ? odd + 1 : 0;
    if (odd > 2) {
      if (!off) since_ns = t_ns;
      off = true;
      last_ns = t_ns;
    } else if (off && t_ns > last_ns + kMargin) {
      mark_off(segment, since_ns - kMargin, last_ns + kMargin);
      off = false;
    }
  }
  if (off) mark_off(segment, since_ns - kMargin, last_ns + kMargin);
}

void guess_ground(Segment& segment, const OdometerState& odometer) {
  std::array<double, 3> plane{};  // of the last keyframe on the ground
  GroundCentre centre;
  for (Keyframe& keyframe : segment.keyframes) {
    const Pose T_WB = smoother::to_pose(keyframe.pose.data());
    if (keyframe.on_ground) {
      const Eigen::Vector3d n = T_WB.R * odometer.T_BO.R.col(2);
      const Eigen::Vector3d O = T_WB.p + T_WB.R * odometer.T_BO.p - odometer.wheel_radius.mean() * n;
      const double a = -n.x() / n.z();
      const double b = -n.y() / n.z();
      centre = {O.x(), O.y()};
      plane = {O.z(), a, b};
    }
    keyframe.centre = {T_WB.p.x(), T_WB.p.y()};
    keyframe.ground = plane;
    keyframe.ground[0] += plane[1] * (keyframe.centre.x - centre.x) + plane[2] * (keyframe.centre.y - centre.y);
  }
}

}  // namespace ear::calibration
