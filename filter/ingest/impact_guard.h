// By how much an inertial sample is less certain than usual: a landing's strike, a spike, a clipped value.
// docs/ingest.md.
#pragma once

#include <Eigen/Core>
#include <cmath>
#include <optional>

#include "ear/calibration.h"
#include "ear/filter_config.h"
#include "ear/types.h"
#include "filter/ingest/imu_buffer.h"

namespace ear {

/// [rad/s^2] chosen: no body turns more suddenly; a multirotor of 1.5 kg, 15 N on one side at 0.15 m.
inline constexpr double kTurnRate = 100.0;

/// Standard deviations of a sample's white noise: the density over the root of the samples' interval [s].
struct SampleSigma {
  SampleSigma(const ImuCalibration& imu, double interval)
      : gyro(imu.gyro_noise / std::sqrt(interval)), accel(imu.accel_noise / std::sqrt(interval)) {}

  double gyro;   ///< [rad/s]
  double accel;  ///< [m/s^2]
};

/// Watches one sensor of three axes.
class ExcessWatch {
 public:
  /// `range`: largest value of an axis, 0 if it is not known. `least`: a smaller deviation from the recent mean is
  /// none. `memory` [s]: what recent means. `error_share`: of a deviation, may be wrong. All else in the sensor's unit.
  ExcessWatch(double range, double least, double memory, double error_share)
      : range_(range), least_(least), memory_(memory), error_share_(error_share) {}

  /// Standard deviation of what may be wrong with the value beyond the sensor's noise; 0 for an ordinary value.
  double add(const Eigen::Vector3d& value, double dt);
  /// Was the last value clipped?
  [[nodiscard]] bool clips() const { return clips_; }

 private:
  [[nodiscard]] bool clipped(const Eigen::Vector3d& value);

  double range_, least_, memory_, error_share_;
  double clip_level_ = 0.0;  ///< where values were seen to be cut off, 0 if never
  bool any_ = false;
  Eigen::Vector3d last_ = Eigen::Vector3d::Zero();
  Eigen::Vector3d mean_ = Eigen::Vector3d::Zero();
  double variance_ = 0.0;  ///< of the distance from the mean
  int lasts_ = 0;          ///< samples in a row out of the ordinary
  bool clips_ = false;
};

class ImpactGuard {
 public:
  explicit ImpactGuard(const ImpactConfig& config);

  /// Samples in time order, finite, as the sensor gives them. Whoever integrates over the piece between two samples
  /// takes the larger factor.
  ImuNoiseFactors add(const ImuSample& sample, const SampleSigma& sigma);
  [[nodiscard]] bool gyro_clips() const { return gyro_.clips(); }  ///< the last sample
  [[nodiscard]] bool accel_clips() const { return accel_.clips(); }

 private:
  ExcessWatch gyro_, accel_;
  std::optional<TimeNs> last_ns_;
};

}  // namespace ear
