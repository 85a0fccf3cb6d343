// The wheels as a source: an increment of the encoders becomes rows of the odometer (5)-(8), and updates the filter.
// The rows: wheel_rows.h. docs/filter.md, "Wheels".
#pragma once

#include <array>
#include <optional>

#include "ear/calibration.h"
#include "ear/filter_config.h"
#include "filter/ekf/displacement.h"
#include "filter/ekf/ekf.h"
#include "filter/ekf/noise_score.h"
#include "filter/ekf/records.h"
#include "filter/ekf/whiteness_score.h"
#include "filter/ingest/imu_buffer.h"
#include "filter/sources/wheels/mounting_watch.h"
#include "filter/sources/wheels/reading_noise.h"
#include "filter/sources/wheels/speed_change.h"
#include "filter/sources/wheels/wheel_rows.h"

namespace ear {

class Wheels {
 public:
  /// The calibration has an encoder. `sees_ground`: there are lasers.
  Wheels(const OdometerConfig& config, const Calibration& calibration, bool sees_ground);

  /// Every increment of wheels that carry the vehicle, also where there is no state: how noisy are the readings?
  void watch(const WheelIncrement& stamped);
  /// As they show themselves: standard deviation of an increment, of the mean of both wheels' paths [m].
  [[nodiscard]] double shown_noise() const { return path_noise_.of_increment(); }

  /// What an update needs to know beside the readings.
  struct Context {
    const ImuBuffer& imu;
    bool ground_known = false;  ///< the lasers have seen the ground since it was last touched
    double weight = 1.0;        ///< (15)
    CameraUpdate calibration = CameraUpdate::considered;
    double gyro_noise = 1.0;  ///< times the stated one
    bool stands = false;
    bool wheels_rest = false;  ///< they do not turn, whatever the inertial sensors measure
  };
  /// The filter's state is near the middle of the increment, or has passed it. `stamped`: by the encoders' own clock.
  void update(const WheelIncrement& stamped, const Context& context, Ekf& ekf, Records& records);

  /// p^o of (13): how far the body will have gone at `to_ns`. Not available without the ground's normal, if it counts.
  [[nodiscard]] Displacement displacement(const Ekf& ekf, const WheelIncrements& increments, const ImuBuffer& imu,
                                          TimeNs to_ns, bool ground_known) const;

  /// Did the velocity not lie in the ground just now, as when the wheels leave the ground or meet it?
  [[nodiscard]] bool lifting(TimeNs t_ns) const;

  /// Does the calibration seem to exchange or reverse axes, as far as they rolled on the ground?
  [[nodiscard]] bool misaligned() const { return mounting_.contradicts(); }

  /// Factor on the accelerometer's noise, 1 or more: wheels do not slip sideways, and the state should not either.
  /// Along the track and through the ground a slip and a bump would be taken for it.
  [[nodiscard]] double accel_noise() const { return sideways_.factor(); }

  /// The state begins anew.
  void reset() { running_ = Running{}; }

 private:
  using Sigmas = Eigen::Matrix<double, WheelRows::size, 1>;

  [[nodiscard]] bool uses_plane() const { return config_.model == OdometerModel::terrain && sees_ground_; }
  /// Standard deviations of the rows, and of what a reading is off by, which is in the state [m].
  struct Noise {
    Sigmas rows;
    double reading = 0.0;
  };
  /// `usual_dt` [s]: of increments like this one.
  [[nodiscard]] Noise noise_of(const WheelRows& rows, const WheelIncrement& increment, const MeanRate& rate,
                               const State& x, double usual_dt) const;
  void count_readings(WheelRows& rows, const WheelIncrement& stamped, double sigma, Ekf& ekf);
  void show_time_offset(WheelRows& rows, const WheelIncrement& stamped, const Ekf& ekf);
  void add_left_out(Sigmas& sigma, const Eigen::Matrix3d& R_WB, const WheelIncrement& increment, const Ekf& ekf) const;
  static void add_delay(Sigmas& sigma, const WheelIncrement& increment, const Ekf& ekf);
  void score_wheels(WheelRows& rows, Sigmas& sigma, const WheelIncrement& increment, const Context& context,
                    const Ekf& ekf, Records& records);
  static void count(const NoiseScore& score, FrameStatistics& statistics);

  /// What the last increments have shown.
  struct Running {
    SpeedChange speed_change;                     ///< of the rims against the body, as the state predicts it
    std::array<NoiseScore, 2> wheel;              ///< left, right
    std::array<NoiseScore, WheelRows::size> row;  ///< of all but the speed, which is the wheels'
    int reading = 0;                              ///< index of the last one in OdometerState::reading_error
    std::optional<TimeNs> read_ns;                ///< its stamp
    std::optional<TimeNs> lifted_ns;              ///< when the velocity last did not lie in the ground
  };

  OdometerConfig config_;
  EncoderCalibration encoder_;
  ImuCalibration imu_;
  bool sees_ground_;
  MountingWatch mounting_;
  ReadingNoise path_noise_;  ///< of the mean of both wheels' paths [m]
  ReadingNoise turn_noise_;  ///< of the turn by their difference [rad]
  WhitenessScore sideways_;  ///< of the row WheelRows::side
  Running running_;
};

}  // namespace ear
