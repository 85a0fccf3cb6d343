// What the inertial sensors did between two samples is not known: how much that adds to the noise of what is
// integrated.
#pragma once

#include <array>

#include "ear/calibration.h"
#include "ear/types.h"
#include "filter/ingest/imu_buffer.h"

namespace ear {

/// Between two samples, dt apart, a signal whose increments have the variance q dt is a Brownian bridge: its mean is
/// off from that of both samples by q dt / 12, in variance. q shows in second differences: 2 q dt each, and 6 variances
/// of the sensor's white noise, which are taken out. Second differences over two steps have twice that: where they have
/// less, it is an oscillation near the sampling limit, which cancels when it is integrated, and these tell q.
class BetweenSamples {
 public:
  explicit BetweenSamples(const ImuCalibration& imu);

  /// Samples in time order. By what the noise that is stated is multiplied, 1 or more.
  [[nodiscard]] ImuNoiseFactors add(const ImuSample& sample);

 private:
  struct Sensor {
    double density = 0.0;                     ///< of its white noise, stated
    std::array<Eigen::Vector3d, 4> before{};  ///< newest first
    double one_step = 0.0, two_steps = 0.0;   ///< squares of the second differences, per axis, over the memory

    /// `share`: of the newest second difference.
    double add(const Eigen::Vector3d& value, double dt, double share);
  };

  Sensor gyro_, accel_;
  TimeNs last_ns_ = 0;
  int count_ = 0;
};

}  // namespace ear
