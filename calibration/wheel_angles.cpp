#include "calibration/wheel_angles.h"

#include <algorithm>

#include "filter/ingest/wheel_increment.h"

namespace ear::calibration {

constexpr double kLongest = 0.1;              // [s] between two readings
constexpr TimeNs kHalfInterval = 20'000'000;  // of a speed

WheelAngles::WheelAngles(const EncoderCalibration& encoder, const std::vector<EncoderSample>& samples) {
  EncoderReader reader(encoder);
  Eigen::Vector2d angle = Eigen::Vector2d::Zero();
  for (const EncoderSample& sample : samples) {
    if (const auto turn = reader.add(sample)) angle += turn->angle;
    readings_.push_back({later_by(encoder.time_offset, sample.t_ns), angle});
  }
}

std::optional<Eigen::Vector2d> WheelAngles::angle(TimeNs t_ns) const {
  const auto later = [](TimeNs time_ns, const Reading& reading) { return time_ns < reading.t_ns; };
  const auto next = std::upper_bound(readings_.begin(), readings_.end(), t_ns, later);
  if (next == readings_.begin() || next == readings_.end()) return std::nullopt;
  const Reading& before = *(next - 1);
  const double duration = seconds_between(before.t_ns, next->t_ns);
  if (duration > kLongest) return std::nullopt;
  return before.angle + seconds_between(before.t_ns, t_ns) / duration * (next->angle - before.angle);
}

std::optional<Eigen::Vector2d> WheelAngles::speed(TimeNs t_ns) const {
  const auto before = angle(t_ns - kHalfInterval);
  const auto after = angle(t_ns + kHalfInterval);
  if (!before || !after) return std::nullopt;
  return (*after - *before) / seconds_between(t_ns - kHalfInterval, t_ns + kHalfInterval);
}

}  // namespace ear::calibration
