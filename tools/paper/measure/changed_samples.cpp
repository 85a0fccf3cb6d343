#include "tools/paper/measure/changed_samples.h"

#include <algorithm>
#include <cmath>

namespace ear::paper {

WithoutPitch::WithoutPitch(const simulator::Simulation& simulation, const Calibration& calibration)
    : encoder_(calibration.encoder.value()) {
  const Eigen::Vector3d axle_B = encoder_.T_BO.rotation().col(1);
  double pitch = 0.0;
  const ImuSample* before = nullptr;
  for (const ImuSample& sample : simulation.imu()) {
    if (before) {
      const double rate = 0.5 * axle_B.dot(before->gyro_B + sample.gyro_B);
      pitch += rate * seconds_between(before->t_ns, sample.t_ns);
    }
    before = &sample;
    times_.push_back(sample.t_ns);
    pitch_.push_back(pitch);
  }
}

EncoderSample WithoutPitch::operator()(const EncoderSample& sample) const {
  const auto turned = std::llround(pitch(sample.t_ns) * static_cast<double>(encoder_.resolution) / (2.0 * M_PI));
  const auto less = [&](std::int64_t count) {
    const std::int64_t difference = count - turned;
    if (!encoder_.wraps) return difference;
    return (difference % encoder_.resolution + encoder_.resolution) % encoder_.resolution;
  };
  return {sample.t_ns, less(sample.left_count), less(sample.right_count)};
}

double WithoutPitch::pitch(TimeNs t_ns) const {
  const auto after = std::upper_bound(times_.begin(), times_.end(), t_ns);
  if (after == times_.begin()) return pitch_.front();
  if (after == times_.end()) return pitch_.back();
  const auto i = static_cast<std::size_t>(after - times_.begin());
  const double share = seconds_between(times_[i - 1], t_ns) / seconds_between(times_[i - 1], times_[i]);
  return pitch_[i - 1] + share * (pitch_[i] - pitch_[i - 1]);
}

LaserSample together(const LaserSample& sample) {
  const bool complete =
      std::all_of(sample.range.begin(), sample.range.end(), [](double r) { return std::isfinite(r); });
  LaserSample result = sample;
  if (!complete) std::fill(result.range.begin(), result.range.end(), std::nan(""));
  return result;
}

}  // namespace ear::paper
