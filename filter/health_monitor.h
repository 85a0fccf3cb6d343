// From what each sensor measured to what the estimator says of itself: which sensors it does not rest on, whether it
// may be used, and which images may. docs/health.md gives the rules and their times.
#pragma once

#include <array>
#include <initializer_list>
#include <optional>

#include "ear/calibration.h"
#include "ear/estimate.h"
#include "ear/health.h"
#include "filter/frame_check.h"
#include "filter/input_guard.h"

namespace ear {

/// For and against one source, over time: mostly wrong for kDistrustAfter seconds, it is trusted no more; mostly right
/// for kTrustAfter, it is again.
class Trust {
 public:
  static constexpr double kDistrustAfter = 0.25;  // [s]
  static constexpr double kTrustAfter = 0.5;      // [s]

  /// What came since the last call. Long silence counts for `kLongest` seconds at most.
  void add(bool wrong, TimeNs t_ns);
  /// Something that never happens to a sound sensor.
  void accuse(TimeNs t_ns);
  /// It has nothing to say, rightly.
  void excuse(TimeNs t_ns);

  [[nodiscard]] bool trusted() const { return trusted_; }
  [[nodiscard]] TimeNs onset_ns() const { return onset_ns_; }

 private:
  double doubt_ = 0.0;    ///< 0 ... 1
  bool doubted_ = false;  ///< since onset_ns_
  bool trusted_ = true;
  TimeNs onset_ns_ = 0;
  std::optional<TimeNs> last_ns_;
};

/// By how much a sensor's stamps are off those of the inertial samples, against what is usual.
class StampWatch {
 public:
  /// A stamp, and that of the newest inertial sample. Is the difference an unusual one?
  bool add(TimeNs stamp_ns, TimeNs imu_ns);

 private:
  int count_ = 0;
  double usual_ = 0.0;   ///< [s]
  double spread_ = 0.0;  ///< [s] mean deviation from it
};

class HealthMonitor {
 public:
  explicit HealthMonitor(const Calibration& calibration, bool uses_wheels, bool uses_beams);

  /// For an estimator that begins anew: lost from `t_ns` on, if the one before had an estimate.
  void succeed(const HealthMonitor& before, TimeNs t_ns);

  /// A sample as it comes, before it is used.
  void add_imu(const ImuSample& sample, double max_gap);
  /// One whose stamp or values cannot be.
  void add_refused_imu();
  /// What only a fault of the sensor does: a spike, a bias that jumps.
  void accuse_imu(bool gyro, bool accel, TimeNs t_ns);
  void accuse_cameras(TimeNs t_ns);
  /// A reading, used or refused, and the stamp of the newest inertial sample.
  void add_encoder(const EncoderSample& sample, Verdict verdict, TimeNs imu_ns);
  void add_laser(const LaserSample& sample, Verdict verdict, const LaserCalibration& lasers, TimeNs imu_ns);

  /// A frame that no inertial samples reach.
  void add_refused_frame(TimeNs imu_ns);

  /// Whether an image may be used, by how it agrees with what the state and the other sensors expect of it. Not one
  /// that repeats the last; not left and right exchanged; not one with a stamp that jumped, which a late one did not.
  [[nodiscard]] bool check_image(const FrameAgreement& agreement, TimeNs t_ns, TimeNs newest_imu_ns);

  /// What is known after a frame was used.
  struct Frame {
    TimeNs t_ns = 0;       ///< IMU time
    bool image = true;     ///< false: the estimator moved on without one
    bool right = true;     ///< false: nobody looked at that of the second camera
    bool running = false;  ///< there is a state
    bool possible = true;  ///< and it and its covariance are numbers, variances not negative
    bool lifted = false;   ///< the vehicle just left the ground or met it, whatever is known of its contact
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
  /// All sources but the inertial ones contradict the state, for long: it may be the state that is wrong.
  [[nodiscard]] bool contradicted() const { return contradicted_; }

 private:
  void judge_cameras(const Frame& frame);
  void accuse_images(TimeNs t_ns);
  void judge_ground(const Frame& frame, const std::array<SourceRecord, kSourceCount>& records);
  void judge_turn(const Frame& frame);
  void note_silence(TimeNs t_ns);
  void decide(TimeNs t_ns);
  [[nodiscard]] Trust& trust(Source source) { return trust_[index_of(source)]; }
  [[nodiscard]] bool trusted(Source source) const { return trust_[index_of(source)].trusted(); }
  [[nodiscard]] bool images_come(TimeNs t_ns) const;
  [[nodiscard]] bool velocity_known() const;
  [[nodiscard]] int quality(const Frame& frame) const;
  void accuse(std::initializer_list<Source> sources, TimeNs t_ns);

  std::size_t cameras_;
  std::size_t beams_;
  bool wheels_;
  std::array<Trust, kSourceCount> trust_;
  Trust carrying_;  ///< do the images carry the estimate? They may, where some of what they show is wrong
  Health health_;
  Frame last_;
  bool any_frame_ = false;  ///< with an image or without

  std::optional<ImuSample> last_imu_;
  std::optional<TimeNs> last_frame_ns_;
  TimeNs last_arrival_ns_ = 0;  ///< the newest inertial stamp when that came
  std::optional<TimeNs> last_refused_imu_ns_;
  double frame_interval_ = 0.0;  ///< [s] usual
  TimeNs last_tick_ns_ = 0;
  std::array<double, kMaxBeams> last_range_{};
  std::array<int, kMaxBeams> repeated_{};
  std::array<bool, kMaxBeams> no_return_{};
  StampWatch camera_stamps_, encoder_stamps_, laser_stamps_;
  double usual_tracks_ = 0.0;
  int frames_counted_ = 0;
  bool camera_stamps_unusual_ = false;
  bool camera_stamps_wrong_ = false;
  bool late_ = false;                                    ///< the last image came late, and fits
  Eigen::Vector3d turn_rate_ = Eigen::Vector3d::Zero();  ///< of the cameras less that of the gyroscope [rad/s], recent
  double turn_scatter_ = 1e-4;                           ///< [rad^2/s^2] of the single ones
  double feigned_turn_ = 0.0;                            ///< [rad/s] recent
  bool turns_otherwise_ = false;
  std::optional<TimeNs> misled_ns_;                 ///< when wheels last did not fit
  TimeNs last_encoder_ns_ = 0, last_laser_ns_ = 0;  ///< newest inertial stamp when they came
  bool started_ = false;
  TimeNs aided_ns_ = 0;
  TimeNs fitting_ns_ = 0;  ///< when something last did not contradict the state
  bool contradicted_ = false;
};

}  // namespace ear
