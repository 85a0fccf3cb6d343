// Inertial samples that are off together, one to five in a row, and then are not: a fault of the sensor or of its bus.
// A body's rate does not jump and return within some samples; a strike's force does, but not by the same in all of
// them. docs/ingest.md, "Spikes".
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstddef>
#include <optional>

#include "ear/calibration.h"
#include "ear/filter_config.h"
#include "ear/types.h"
#include "filter/ingest/impact_guard.h"
#include "filter/ingest/imu_buffer.h"

namespace ear {

/// Which of the inertial sensors is at fault?
struct ImuFault {
  bool gyro = false;
  bool accel = false;
  [[nodiscard]] bool any() const { return gyro || accel; }
};

/// Watches one sensor of three axes.
class SpikeWatch {
 public:
  using Value = Eigen::Vector3d ImuSample::*;
  using Factor = double ImuNoiseFactors::*;

  /// `sigma`: of a sample's white noise, at first. `least`, or `least_rate` [1/s]: of a step between samples, no
  /// smaller one is a jump. `strikes`: the body may do it as well. All in the sensor's unit.
  SpikeWatch(Value value, Factor factor, double sigma, double least, double least_rate, bool strikes)
      : value_(value),
        factor_(factor),
        sigma_(sigma),
        least_(least),
        least_rate_(least_rate),
        strikes_(strikes),
        step_variance_(6.0 * sigma * sigma) {}

  void set_sigma(double sigma) { sigma_ = sigma; }
  /// The newest of `samples` came `dt` [s] after the one before; between them `lost` did not come. Until its end is
  /// seen, a spike is held at the value before it; from then on, a line crosses it, and what was lost in it. Did one
  /// end? A line crosses what was lost elsewhere, too.
  bool add(ImuBuffer& samples, double dt, int lost, bool clips);
  /// Has one begun whose end was not seen yet?
  [[nodiscard]] bool in_doubt() const { return doubt_.length > 0; }
  /// Factor on the noise for each interval for which a sample's value is held: the variance of the integral of the walk
  /// over n intervals is q n^3 / 3.
  [[nodiscard]] double held() const;
  /// Factor on the noise, 1 or more, by what two steps in a row share: the white noise of the sample between them is in
  /// both, with opposite signs; of the body's motion there is little.
  [[nodiscard]] double white() const;
  /// The newest sample ends no spike, and those before it were none: a strike, which leaves them as uncertain as a
  /// spike.
  void give_up(ImuBuffer& samples);

 private:
  static constexpr std::size_t kLongest = 5;

  /// What may be a spike.
  struct Doubt {
    std::array<Eigen::Vector3d, kLongest> measured;
    std::size_t length = 0;
    std::size_t lost = 0;  ///< samples that did not come meanwhile
    double seconds = 0.0;  ///< from the sample before it to its newest
    bool clipped = false;  ///< one of them
  };

  void hold(ImuBuffer& samples, double dt, bool clips);
  /// `seconds`: from the sample before it to the one after.
  void replace(ImuBuffer& samples, double seconds);
  void cross(ImuBuffer& samples, double dt, int lost);
  /// What the body did in so many seconds; nothing that a spike does.
  void count(double step, double seconds);

  Value value_;
  Factor factor_;
  double sigma_, least_, least_rate_;
  bool strikes_;
  double step_variance_;                        ///< of the recent steps between samples, all axes together
  std::optional<Eigen::Vector3d> last_change_;  ///< the step before the newest, if it was the body's
  double shared_ = 0.0;                         ///< mean product of two steps in a row, all axes together
  Doubt doubt_;
};

class ImuSpikes {
 public:
  ImuSpikes(const ImpactConfig& config, const ImuCalibration& imu);

  /// Of the white noise of the samples that follow.
  void set_sigma(const SampleSigma& sigma);
  /// What ended with the newest of `samples`, which came `dt` [s] after the one before, of those between them `lost`
  /// not. `accel_clips`: it is clipped.
  ImuFault add(ImuBuffer& samples, double dt, int lost, bool accel_clips);
  /// May the newest samples be those of a spike?
  [[nodiscard]] bool in_doubt() const { return gyro_.in_doubt() || accel_.in_doubt(); }
  /// Factors on the noise, per interval for which the values of a sample are held.
  [[nodiscard]] ImuNoiseFactors held() const { return {gyro_.held(), accel_.held()}; }
  /// Factor on the accelerometer's noise, 1 or more, as its samples show it.
  [[nodiscard]] double white_accel() const { return accel_.white(); }
  /// The newest came after a gap in which anything may have happened.
  void give_up(ImuBuffer& samples);

 private:
  SpikeWatch gyro_, accel_;
};

}  // namespace ear
