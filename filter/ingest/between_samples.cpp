#include "filter/ingest/between_samples.h"

#include <algorithm>
#include <cmath>

namespace ear {
namespace {

constexpr double kMemory = 0.1;  // [s] over which second differences are averaged; chosen: some samples of any sensor

}  // namespace

BetweenSamples::BetweenSamples(const ImuCalibration& imu) {
  gyro_.density = imu.gyro_noise;
  accel_.density = imu.accel_noise;
}

ImuNoiseFactors BetweenSamples::add(const ImuSample& sample) {
  const double dt = seconds_between(last_ns_, sample.t_ns);
  last_ns_ = sample.t_ns;
  const int needed = static_cast<int>(gyro_.before.size()) + 1;  // for a second difference over two steps
  count_ = count_ > 0 && dt > kMemory ? 1 : std::min(count_ + 1, needed);
  const double share = count_ < needed ? 0.0 : dt / (dt + kMemory);
  return {gyro_.add(sample.gyro_B, dt, share), accel_.add(sample.accel_B, dt, share)};
}

double BetweenSamples::Sensor::add(const Eigen::Vector3d& value, double dt, double share) {
  one_step += share * ((value - 2.0 * before[0] + before[1]).squaredNorm() / 3.0 - one_step);
  two_steps += share * ((value - 2.0 * before[1] + before[3]).squaredNorm() / 3.0 - two_steps);
  before = {value, before[0], before[1], before[2]};
  const double noise = density * density / dt;
  if (share == 0.0 || !(noise > 0.0)) return 1.0;
  return std::sqrt(1.0 + std::max(0.0, std::min(one_step, two_steps / 2.0) - 6.0 * noise) / (24.0 * noise));
}

}  // namespace ear
