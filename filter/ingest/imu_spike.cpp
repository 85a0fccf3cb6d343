#include "filter/ingest/imu_spike.h"

namespace ear {
namespace {

constexpr double kAccelSpike = 25.0;  // [m/s^2] chosen: of one sample from the mean of its neighbours
constexpr double kGyroSpike = 2.0;    // [rad/s] chosen: the same
constexpr double kSpikeRatio = 4.0;   // chosen: and so many times the difference of these

bool is_spike(const Eigen::Vector3d& a, const Eigen::Vector3d& b, const Eigen::Vector3d& c, double least) {
  const double off = (b - 0.5 * (a + c)).norm();
  return off > least && off > kSpikeRatio * (c - a).norm();
}

}  // namespace

ImuFault find_spike(const ImuSample& before, const ImuSample& suspect, const ImuSample& after) {
  return {is_spike(before.gyro_B, suspect.gyro_B, after.gyro_B, kGyroSpike),
          is_spike(before.accel_B, suspect.accel_B, after.accel_B, kAccelSpike)};
}

}  // namespace ear
