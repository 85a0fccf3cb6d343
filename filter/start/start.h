// Where the filter begins: as given, standing, rolling, or in motion by its cameras. Each gives a start state, or
// nothing. docs/filter.md, "Starts".
#pragma once

#include <Eigen/Core>
#include <optional>

#include "ear/calibration.h"
#include "ear/filter_config.h"
#include "ear/given_start.h"
#include "filter/advice.h"
#include "filter/ekf/ekf.h"
#include "filter/ekf/records.h"
#include "filter/ingest/ingest.h"
#include "filter/sources/sources.h"
#include "filter/start/map_alignment.h"
#include "filter/start/moving_start.h"

namespace ear {

struct StartState {
  ImuState x;
  Eigen::VectorXd sigma;  ///< standard deviations of the whole error vector
  /// Whitened, residual = H e + n, by what comes before the cameras: what the mean samples show of attitude and biases
  /// of a vehicle that stands, what was given of the velocity, or what the fit to the images of one in motion knows.
  /// Else no rows.
  Eigen::Matrix<double, Eigen::Dynamic, err::camera> H;
  Eigen::VectorXd residual;
  std::optional<ImuNoiseFactors> imu_noise;  ///< on the stated noise, as the images of one in motion show it
  bool from_frames = false;  ///< in motion, at the first of the frames kept: all of them are to be taken in
  std::optional<MapAlignment> alignment;  ///< where it was given
};

class Start {
 public:
  Start(const FilterConfig& config, const Calibration& calibration);

  /// There is no other start than this one, which is usable, until it is the state.
  void give(const GivenStart& start) { given_ = start; }
  /// What the other one was given.
  void succeed(const Start& before) { given_ = before.given_; }
  /// What the last call of find() lacked; without meaning where it found a start.
  [[nodiscard]] Reason waits_for() const { return waits_for_; }

  /// The vehicle at a frame.
  struct Situation {
    const FeatureFrame& frame;
    TimeNs t_ns = 0;       ///< IMU time
    ImuStatistics recent;  ///< of the inertial samples
    bool stands = false;
    bool rolls = false;         ///< the wheels carry it
    double wheel_noise = 0.0;   ///< [m] of one increment, as they show it
    bool lost = false;          ///< there is a state
    bool contradicted = false;  ///< which the cameras contradict
  };
  /// The one that was given, or else the first that can: standing, rolling, moving. Where there is a state, moving
  /// alone, once that is contradicted.
  [[nodiscard]] std::optional<StartState> find(const Situation& now, const Ingest& ingest);
  void forget_frames() { moving_.clear(); }

  /// The filter begins there, and takes in the frames since; the last one is at hand, and not taken in here. Where the
  /// world of the new state lies in that of the last good estimate, if there was one.
  MapAlignment begin(const StartState& start, const std::optional<Estimate>& last_good, const Advice& advice,
                     Ingest& ingest, Ekf& ekf, Sources& sources, Records& records);

  /// Nothing but the wheels' calibration gives a length: there is neither camera nor laser.
  [[nodiscard]] bool scale_is_given() const;

 private:
  [[nodiscard]] std::optional<StartState> as_given(TimeNs t_ns, const ImuBuffer& imu);
  [[nodiscard]] std::optional<StartState> moving(const Situation& now, const ImuBuffer& imu);
  [[nodiscard]] std::optional<StartState> standing(TimeNs t_ns, const ImuStatistics& imu) const;
  [[nodiscard]] Eigen::VectorXd sigma() const;
  [[nodiscard]] StartState in_motion(const StartAttempt& attempt) const;

  FilterConfig config_;
  Calibration calibration_;
  MovingStart moving_;
  std::optional<GivenStart> given_;
  Reason waits_for_ = Reason::few_samples;
};

}  // namespace ear
