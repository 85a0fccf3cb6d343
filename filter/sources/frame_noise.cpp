#include "filter/sources/frame_noise.h"

#include <algorithm>
#include <cmath>

#include "filter/ingest/limits.h"

namespace ear {
namespace {

struct Explained {
  bool agrees = true;   ///< there is nothing to explain
  double factor = 1.0;  ///< on the stated noise
};

/// `largest`: the most that an error of the sensor makes of it.
Explained explain(const FrameNoise::Seen& seen, double largest) {
  Explained result;
  for (int axis = 0; axis < 3; ++axis) {
    const double square = seen.beyond(axis) * seen.beyond(axis);
    const double expected = seen.others(axis) + seen.believed * seen.believed * seen.noise(axis);
    if (square <= kClear * kClear * expected) continue;
    result.agrees = false;
    if (!(std::sqrt(square) < largest + kClear * std::sqrt(expected))) continue;
    const double by_sensor = std::min(square - seen.others(axis), largest * largest);
    result.factor = std::max(result.factor, std::sqrt(by_sensor / seen.noise(axis)));
  }
  return result;
}

}  // namespace

ImuLimits imu_limits(const PriorConfig& prior) {
  return {kClear * prior.gyro_bias, std::sqrt(kFarthest) * prior.accel_bias};
}

void FrameNoise::add_turn(const Seen& turn, double duration) {
  factors_.gyro = explain(turn, limits_.gyro * duration).factor;
}

void FrameNoise::add_way(const Seen& way, double duration, TimeNs t_ns) {
  const double since = agreed_ns_ ? seconds_between(*agreed_ns_, t_ns) : INFINITY;
  const Explained explained = explain(way, limits_.accel * since * duration);
  if (since <= kStale) factors_.accel = explained.factor;
  if (explained.agrees || factors_.accel > 1.0) agreed_ns_ = t_ns;
}

}  // namespace ear
