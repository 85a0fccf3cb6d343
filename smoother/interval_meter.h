// What all sensors but the cameras measure of the interval from one frame to the next: inertial samples and wheels
// pre-integrated, the latter along the ground that the lasers see. docs/smoother.md.
#pragma once

#include <array>
#include <optional>
#include <vector>

#include "ear/calibration.h"
#include "ear/filter_config.h"
#include "filter/advice.h"
#include "filter/ekf/displacement.h"
#include "filter/ekf/gate.h"
#include "filter/ekf/noise_score.h"
#include "filter/ekf/records.h"
#include "filter/ekf/state.h"
#include "filter/ingest/ingest.h"
#include "smoother/ground_normal.h"
#include "smoother/interval.h"

namespace ear::smoother {

class IntervalMeter {
 public:
  IntervalMeter(const FilterConfig& config, const Calibration& calibration);

  /// The first interval begins now. `stands`: the vehicle does.
  void begin(bool stands);
  /// The wheels left the ground, or met it.
  void forget_ground() { normal_.forget(); }

  /// An interval, before anything of it is used.
  struct Situation {
    const State& x;   ///< at the frame before
    TimeNs t_ns = 0;  ///< of the new frame, IMU time
    const Displacements& displacements;
    Advice advice;
    bool rolls = false;   ///< the wheels show how the vehicle moves
    bool stands = false;  ///< at the new frame
  };
  /// Takes the readings up to the new frame out of `ingest`.
  [[nodiscard]] NewFrame measure(const Situation& now, Ingest& ingest, Records& records);

  /// At the newest frame.
  [[nodiscard]] const GroundNormal& normal() const { return normal_; }

 private:
  [[nodiscard]] ImuPreintegration preintegrate(const Situation& now, const ImuBuffer& imu) const;
  [[nodiscard]] std::optional<WheelDisplacement> roll(const Situation& now, Ingest& ingest, Records& records);
  [[nodiscard]] std::optional<WheelDisplacement> integrate_wheels(const Situation& now,
                                                                  const std::vector<IncrementPart>& parts,
                                                                  const std::vector<BeamRanges>& ranges,
                                                                  const ImuBuffer& imu, Records& records);
  [[nodiscard]] bool add_noise(WheelDisplacement& z, const Situation& now, Records& records);
  void move_normal(TimeNs t_ns, const Eigen::Vector3d& b_g, const ImuBuffer& imu);

  OdometerConfig odometer_;
  ImuCalibration imu_;
  WheelNoise wheel_noise_;
  Gate gate_;
  GroundNormal normal_;
  TimeNs normal_ns_ = 0;              ///< up to where it was moved
  double speed_ = 0.0;                ///< of the wheels of late [m/s]
  std::array<NoiseScore, 3> scores_;  ///< the wheels with the inertial samples: forward, sideways, upwards
  bool was_still_ = false;            ///< at the frame before
};

}  // namespace ear::smoother
