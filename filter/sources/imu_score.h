// How noisy the inertial sensors are: what they measure between two images, against what the images show. Vibration,
// samples that are missing and stamps that are wrong make them noisier than their data sheet. docs/filter.md,
// "Propagation".
#pragma once

#include "filter/ekf/covariance.h"
#include "filter/ekf/imu_displacement.h"
#include "filter/ekf/noise_score.h"
#include "filter/sources/cameras/stereo_motion.h"

namespace ear {

class ImuScore {
 public:
  /// `adapts`: false for the noise that the calibration states.
  explicit ImuScore(bool adapts) : adapts_(adapts) {}

  /// The motion from the state to a frame at `t_ns` by the inertial samples, and as the images show it. `P`: of the
  /// state's error.
  void add(const ImuMotion& motion, const StereoMotion& images, const Covariance& P, TimeNs t_ns);

  /// Factors on the noise of all samples, 1 or more.
  [[nodiscard]] ImuNoiseFactors noise() const;

 private:
  static constexpr double kMemory = 2.0;      // [s] chosen: a single image that is wrong changes little,
  static constexpr double kFarthest = 100.0;  // chosen: counting as ten times the usual noise at most

  bool adapts_;
  NoiseScore gyro_{kMemory, kFarthest}, accel_{kMemory, kFarthest};
};

}  // namespace ear
