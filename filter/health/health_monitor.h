// From what each sensor measured to what the estimator reports of itself: which sensors are at fault, whether the
// estimate may be used, and which images may. It reads records and changes nothing. docs/health.md gives the rules.
#pragma once

#include <array>
#include <bitset>
#include <initializer_list>
#include <optional>

#include "ear/calibration.h"
#include "ear/estimate.h"
#include "ear/health.h"
#include "filter/health/fault_state.h"
#include "filter/health/image_health.h"
#include "filter/ingest/beam_ranges.h"
#include "filter/ingest/imu_spike.h"
#include "filter/ingest/input_guard.h"

namespace ear {

class HealthMonitor {
 public:
  HealthMonitor(const Calibration& calibration, bool uses_wheels, bool uses_beams);

  /// For an estimator that begins anew: lost from `t_ns` on, if the one before had an estimate.
  void succeed(const HealthMonitor& before, TimeNs t_ns);

  /// The stamp of a sample as it comes, before it is used.
  void add_imu(TimeNs t_ns, const ImuVerdict& verdict);
  /// One whose stamp or values cannot be.
  void add_refused_imu();
  /// What only a fault of the sensor does: a spike, a clipped value, a bias that jumps.
  void report_imu_fault(const ImuFault& fault, TimeNs t_ns);
  void report_camera_fault(TimeNs t_ns);
  /// A reading, used or refused, and the stamp of the newest inertial sample. `stuck`: beams that give the same range
  /// again and again.
  void add_encoder(Verdict verdict, TimeNs imu_ns);
  void add_laser(const LaserSample& sample, Verdict verdict, const LaserCalibration& lasers,
                 const std::bitset<kMaxBeams>& stuck, TimeNs imu_ns);

  /// A frame that no inertial samples reach.
  void add_refused_frame(TimeNs imu_ns);

  /// May this image be used? See ImageHealth::check.
  [[nodiscard]] bool check_image(const FrameAgreement& agreement, TimeNs t_ns) {
    return images_.check(agreement, t_ns);
  }

  /// What is known after a frame was used.
  struct Frame {
    TimeNs t_ns = 0;                      ///< IMU time
    bool image = true;                    ///< false: the estimator moved on without one
    bool running = false;                 ///< there is a state
    bool possible = true;                 ///< and it and its covariance are numbers, variances not negative
    Reason waits_for = Reason::no_frame;  ///< what the start waits for
    bool misaligned = false;              ///< sensors point elsewhere than the calibration allows
    bool lifted = false;  ///< the vehicle just left the ground or met it, whatever is known of its contact
    FrameAgreement agreement;
    FrameStatistics statistics;
    double speed = 0.0;             ///< [m/s]
    double velocity_sigma = 0.0;    ///< [m/s] worst axis, seen from the vehicle
    double horizontal_sigma = 0.0;  ///< [m]
    double vertical_sigma = 0.0;    ///< [m]
  };
  void add_frame(const Frame& frame, const std::array<SourceRecord, kSourceCount>& records);

  [[nodiscard]] const Health& health() const { return health_; }
  [[nodiscard]] bool lost() const { return health_.status == HealthStatus::lost; }
  /// May the state be given away?
  [[nodiscard]] bool usable() const {
    return health_.status == HealthStatus::tracking || health_.status == HealthStatus::degraded;
  }
  /// Can a vehicle be where and as fast as the state says? And if it was lost, do the wheels not refute it, where no
  /// camera can tell? Else it is no state.
  [[nodiscard]] bool possible() const;
  /// All sources but the inertial ones contradict the state, for long: it may be the state that is wrong.
  [[nodiscard]] bool contradicted() const { return life_.contradicted; }

 private:
  void judge_ground(const Frame& frame, const std::array<SourceRecord, kSourceCount>& records);
  void note_silence(TimeNs t_ns);
  void decide(TimeNs t_ns);
  [[nodiscard]] Reason reason(TimeNs t_ns) const;
  [[nodiscard]] bool wheels_carry(const FrameStatistics& frame) const;
  [[nodiscard]] Aiding aiding_at(TimeNs t_ns) const;
  [[nodiscard]] const FaultState& fault_of(Source source) const;
  [[nodiscard]] bool velocity_known() const;
  void report(std::initializer_list<Source> sources, TimeNs t_ns);

  /// Stamps [ns] of what came last.
  struct Arrivals {
    std::optional<TimeNs> imu_ns;
    std::optional<TimeNs> encoder_ns, laser_ns;  ///< newest inertial stamp when they came
    std::optional<TimeNs> wheel_rows_ns;         ///< of the last frame for which the wheels measured something
    double encoder_interval = 0.0;               ///< [s] between the last two
  };
  /// Since when the estimator is what it is.
  struct Life {
    bool started = false;
    bool any_frame = false;  ///< with an image or without
    TimeNs aided_ns = 0;
    TimeNs fitting_ns = 0;   ///< when something last did not contradict the state
    TimeNs unproven_ns = 0;  ///< while lost: when nothing carried the estimate, or the images contradicted it
    bool contradicted = false;
    double travelled = 0.0;  ///< [m] while an estimate was given: what is lost may run anywhere
  };

  std::size_t beams_;
  bool wheels_;
  std::array<FaultState, kSourceCount> faults_;  ///< of all but the cameras
  ImageHealth images_;
  std::array<bool, kMaxBeams> no_return_{};
  Arrivals arrivals_;
  Life life_;
  Frame last_;
  Health health_;
};

}  // namespace ear
