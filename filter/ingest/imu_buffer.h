// The last seconds of inertial samples, in time order.
#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <cstddef>
#include <type_traits>

#include "ear/types.h"
#include "filter/ingest/ring.h"

namespace ear {

/// Factors on the standard deviations of a sample's white noise, 1 or more.
struct ImuNoiseFactors {
  double gyro = 1.0;
  double accel = 1.0;
};

/// Mean and spread of the samples of an interval.
struct ImuStatistics {
  int count = 0;
  double duration = 0.0;  ///< [s] from the first sample used to the last
  Eigen::Vector3d gyro_mean = Eigen::Vector3d::Zero();
  Eigen::Vector3d accel_mean = Eigen::Vector3d::Zero();
  double gyro_spread = 0.0;   ///< standard deviation, largest axis [rad/s]
  double accel_spread = 0.0;  ///< [m/s^2]
  // Standard error of the means, as the first and the second half of the samples show it, largest axis: white noise or
  // not.
  double gyro_error = 0.0;   ///< [rad/s]
  double accel_error = 0.0;  ///< [m/s^2]
  // White noise, by the differences of samples in a row: what changes slowly does not count. Mean of the axes.
  double gyro_density = 0.0;   ///< [rad/s/sqrt(Hz)]
  double accel_density = 0.0;  ///< [m/s^2/sqrt(Hz)]
};

/// Mean angular rate over an interval.
struct MeanRate {
  Eigen::Vector3d gyro_B = Eigen::Vector3d::Zero();  ///< [rad/s]
  double noise_factor = 1.0;                         ///< the largest of the samples'
};

/// Of fixed capacity; the oldest sample makes room.
class ImuBuffer {
 public:
  struct Entry {
    ImuSample sample;
    ImuNoiseFactors noise;
  };

  explicit ImuBuffer(std::size_t capacity) : entries_(capacity) {}

  void push(const ImuSample& sample, const ImuNoiseFactors& noise = {});
  /// Factors on the noise per second for which the newest sample's values are held.
  void set_walk(const ImuNoiseFactors& per_second) { walk_ = per_second; }
  /// The sample that so many came after, to correct it: its stamp stays.
  [[nodiscard]] Entry& entry(std::size_t age) { return entries_[size() - 1 - age]; }

  [[nodiscard]] bool empty() const { return entries_.empty(); }
  [[nodiscard]] std::size_t size() const { return entries_.size(); }
  /// Oldest first.
  [[nodiscard]] const ImuSample& operator[](std::size_t i) const { return entries_[i].sample; }
  [[nodiscard]] const ImuSample& newest() const { return entries_.back().sample; }

  /// Samples with from_ns <= t <= to_ns.
  [[nodiscard]] ImuStatistics statistics(TimeNs from_ns, TimeNs to_ns) const;

  /// From `from_ns` to `to_ns`, which is later.
  [[nodiscard]] MeanRate mean_rate(TimeNs from_ns, TimeNs to_ns) const;

  /// Calls f(gyro_B, accel_B, dt) for consecutive pieces of [from_ns, to_ns], with the mean over each piece of the
  /// samples interpolated linearly; or f(gyro_B, accel_B, dt, noise) with the larger factors of the samples at both
  /// ends. Before the first and after the last sample their values are held.
  template <typename Function>
  void for_each_piece(TimeNs from_ns, TimeNs to_ns, const Function& f) const {
    if (empty()) return;
    std::size_t next = first_after(from_ns);
    ImuSample start = interpolate(next, from_ns);
    while (start.t_ns < to_ns) {
      const ImuSample end = next < size() && (*this)[next].t_ns <= to_ns ? (*this)[next] : interpolate(next, to_ns);
      const Eigen::Vector3d gyro_B = 0.5 * (start.gyro_B + end.gyro_B);
      const Eigen::Vector3d accel_B = 0.5 * (start.accel_B + end.accel_B);
      const double dt = seconds_between(start.t_ns, end.t_ns);
      if constexpr (std::is_invocable_v<Function, Eigen::Vector3d, Eigen::Vector3d, double, ImuNoiseFactors>) {
        f(gyro_B, accel_B, dt, noise_around(next, end.t_ns));
      } else {
        f(gyro_B, accel_B, dt);
      }
      start = end;
      ++next;
    }
  }

 private:
  /// Index of the first sample later than t_ns, or size().
  [[nodiscard]] std::size_t first_after(TimeNs t_ns) const;
  /// The value at t_ns, which lies between samples next - 1 and next.
  [[nodiscard]] ImuSample interpolate(std::size_t next, TimeNs t_ns) const;

  /// Of the samples before and at `next`, the larger; after the last one, of what holding it until `to_ns` adds.
  [[nodiscard]] ImuNoiseFactors noise_around(std::size_t next, TimeNs to_ns) const;

  Ring<Entry> entries_;
  ImuNoiseFactors walk_{0.0, 0.0};
};

}  // namespace ear
