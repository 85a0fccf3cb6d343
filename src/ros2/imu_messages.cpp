#include "src/ros2/imu_messages.h"

#include <string>

namespace ear::ros2 {
namespace {

constexpr TimeNs kLongestGap = 100'000'000;  // between two accelerations to interpolate over
constexpr std::size_t kMostSamples = 4000;   // samples of either, 4 s at 1 kHz

Eigen::Vector3d vector(const Vector3& v) { return {v.x, v.y, v.z}; }

}  // namespace

void ImuMessages::take(const RawMessage& message, std::vector<ImuSample>& samples, Warnings& warnings) {
  const auto imu = decode<Imu>(message);
  const ImuSample sample{stamp_of(message, imu.header), vector(imu.angular_velocity), vector(imu.linear_acceleration)};
  if (!topics_.imu_apart()) {
    samples.push_back(sample);
    return;
  }
  const bool accel = message.topic == topics_.accel;
  std::deque<ImuSample>& queue = accel ? accel_ : gyro_;
  const StampOrder::Order order = (accel ? accel_order_ : gyro_order_).take(sample.t_ns);
  if (order == StampOrder::Order::anew) queue.clear();
  if (order == StampOrder::Order::duplicate || order == StampOrder::Order::earlier) {
    warnings.add("imu0: backward stamp", message.topic + ": " + std::to_string(sample.t_ns) + " ns");
    return;
  }
  queue.push_back(sample);
  pair(samples, warnings);
}

void ImuMessages::pair(std::vector<ImuSample>& samples, Warnings& warnings) {
  while (!gyro_.empty() && !accel_.empty()) {
    const ImuSample& gyro = gyro_.front();
    while (accel_.size() > 1 && accel_[1].t_ns <= gyro.t_ns) accel_.pop_front();
    const ImuSample& before = accel_.front();
    const bool exact = before.t_ns == gyro.t_ns;
    if (before.t_ns < gyro.t_ns && accel_.size() == 1 && gyro_.size() < kMostSamples) return;  // the next is to come
    const bool enclosed = accel_.size() > 1 && before.t_ns < gyro.t_ns;
    if (exact) {
      samples.push_back({gyro.t_ns, gyro.gyro_B, before.accel_B});
    } else if (enclosed && accel_[1].t_ns - before.t_ns <= kLongestGap) {
      const double part = seconds_between(before.t_ns, gyro.t_ns) / seconds_between(before.t_ns, accel_[1].t_ns);
      samples.push_back({gyro.t_ns, gyro.gyro_B, before.accel_B + part * (accel_[1].accel_B - before.accel_B)});
    } else {
      warnings.add("imu0: no acceleration around a rate", topics_.gyro + ": " + std::to_string(gyro.t_ns) + " ns");
    }
    gyro_.pop_front();
  }
  if (accel_.size() > kMostSamples) accel_.pop_front();
  if (gyro_.size() > kMostSamples) {
    warnings.add("imu0: no acceleration around a rate", topics_.gyro + ": " + std::to_string(gyro_.front().t_ns));
    gyro_.pop_front();
  }
}

}  // namespace ear::ros2
