// Inertial samples that are off together, one to five in a row, and then are not: a fault of the sensor or of its bus.
// A body's rate does not jump and return within some samples; a strike's force does, but not by the same in all of
// them. docs/ingest.md, "Spikes".
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstddef>

#include "ear/calibration.h"
#include "ear/filter_config.h"
#include "ear/types.h"
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

  /// `sigma`: of a sample's white noise. `least`, or `least_rate` [1/s]: of a step between samples, no smaller one is a
  /// jump. `strikes`: the body may do it as well. All in the sensor's unit.
  SpikeWatch(Value value, Factor factor, double sigma, double least, double least_rate, bool strikes)
      : value_(value),
        factor_(factor),
        sigma_(sigma),
        least_(least),
        least_rate_(least_rate),
        strikes_(strikes),
        step_variance_(6.0 * sigma * sigma) {}

  /// The newest of `samples` came `dt` [s] after the one before. `no_strike`: the other sensor jumped with this one.
  /// Until its end is seen, a spike is held at the value before it; from then on, a line crosses it. Did one end?
  bool add(ImuBuffer& samples, double dt, bool no_strike, bool clips);
  /// Samples in a row, with the newest, that may be a spike.
  [[nodiscard]] std::size_t length() const { return length_; }
  /// The newest sample ends no spike, and those before it were none: a strike, which leaves them as uncertain as a
  /// spike.
  void give_up(ImuBuffer& samples);

 private:
  static constexpr std::size_t kLongest = 5;

  void replace(ImuBuffer& samples, bool in_doubt);

  Value value_;
  Factor factor_;
  double sigma_, least_, least_rate_;
  bool strikes_;
  double step_variance_;  ///< of the recent steps between samples, all axes together
  std::array<Eigen::Vector3d, kLongest> measured_;
  std::size_t length_ = 0;
};

class ImuSpikes {
 public:
  ImuSpikes(const ImpactConfig& config, const ImuCalibration& imu);

  /// What ended with the newest of `samples`, which came `dt` [s] after the one before. `accel_clips`: it is clipped.
  ImuFault add(ImuBuffer& samples, double dt, bool accel_clips);
  /// The newest came after a gap.
  void give_up(ImuBuffer& samples);

 private:
  SpikeWatch gyro_, accel_;
};

}  // namespace ear
