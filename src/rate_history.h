// The angular rate at the time of an estimate: an exposure is older than the newest inertial sample, by more the busier
// the machine is.
#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <deque>
#include <iterator>

#include "ear/types.h"

namespace ear {

class RateHistory {
 public:
  /// Every inertial sample, in time order. One that is older than the one before begins a new history.
  void add(const ImuSample& sample) {
    if (!samples_.empty() && sample.t_ns <= samples_.back().t_ns) samples_.clear();
    samples_.push_back(sample);
    while (seconds_between(samples_.front().t_ns, sample.t_ns) > kKept) samples_.pop_front();
  }

  /// What the gyroscope measured at t_ns, bias included [rad/s]: between two samples by interpolation, outside of them
  /// the nearest; zero where there is none.
  [[nodiscard]] Eigen::Vector3d gyro_B(TimeNs t_ns) const {
    if (samples_.empty()) return Eigen::Vector3d::Zero();
    const auto later = std::lower_bound(samples_.begin(), samples_.end(), t_ns,
                                        [](const ImuSample& sample, TimeNs t) { return sample.t_ns < t; });
    if (later == samples_.begin()) return later->gyro_B;
    if (later == samples_.end()) return samples_.back().gyro_B;
    const auto earlier = std::prev(later);
    const double part = seconds_between(earlier->t_ns, t_ns) / seconds_between(earlier->t_ns, later->t_ns);
    return (1.0 - part) * earlier->gyro_B + part * later->gyro_B;
  }

 private:
  static constexpr double kKept = 2.0;  // [s] more than from an exposure to its estimate on a busy machine; chosen

  std::deque<ImuSample> samples_;  ///< oldest first
};

}  // namespace ear
