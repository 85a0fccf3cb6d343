#include "filter/ingest/wheel_increment.h"

#include <algorithm>
#include <cmath>
#include <utility>

namespace ear {

double EncoderReader::angle(std::int64_t from, std::int64_t to) const {
  std::int64_t d = to - from;
  if (calibration_.wraps) {
    const std::int64_t n = calibration_.resolution;
    d %= n;
    if (2 * d >= n) d -= n;
    if (2 * d < -n) d += n;
  }
  return 2.0 * M_PI * static_cast<double>(d) / static_cast<double>(calibration_.resolution);
}

std::optional<WheelIncrement> EncoderReader::add(const EncoderSample& sample) {
  const std::optional<EncoderSample> before = std::exchange(last_, sample);
  if (!before) return std::nullopt;
  return WheelIncrement{before->t_ns,
                        sample.t_ns,
                        {angle(before->left_count, sample.left_count), angle(before->right_count, sample.right_count)}};
}

double EncoderReader::largest_angle(const EncoderSample& sample) const {
  return std::max(std::abs(angle(last_->left_count, sample.left_count)),
                  std::abs(angle(last_->right_count, sample.right_count)));
}

}  // namespace ear
