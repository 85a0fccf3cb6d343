// The estimator: inertial samples, wheel and laser readings and feature tracks in, state and covariance out. An MSCKF
// with right-invariant error.
//
// Per frame (Filter::process): propagate to the frame's time, taking in wheels and lasers on the way, each at its own
// time; if the vehicle stands, hold it; else clone the pose, take in the frame's observations, update once with all
// features that ended or fill the window, and make room in the window.
//
// filter.cpp: samples in, frames through, estimates out. filter_start.cpp: starting and starting again.
// filter_motion.cpp: the state moves on. filter_ground.cpp: contact, wheels, lasers. filter_images.cpp: clones and
// features.
#pragma once

#include <array>
#include <optional>
#include <vector>

#include "ear/calibration.h"
#include "ear/estimate.h"
#include "ear/filter_config.h"
#include "ear/types.h"
#include "filter/anchor.h"
#include "filter/bias_watch.h"
#include "filter/camera_displacement.h"
#include "filter/chi_squared.h"
#include "filter/consistency.h"
#include "filter/contact.h"
#include "filter/covariance.h"
#include "filter/estimator.h"
#include "filter/feature_update.h"
#include "filter/frame_check.h"
#include "filter/health_monitor.h"
#include "filter/image_noise.h"
#include "filter/impact_guard.h"
#include "filter/imu_buffer.h"
#include "filter/imu_clock.h"
#include "filter/input_guard.h"
#include "filter/moving_start.h"
#include "filter/ring.h"
#include "filter/source_log.h"
#include "filter/standstill.h"
#include "filter/state.h"
#include "filter/stream_clock.h"
#include "filter/tracks.h"
#include "filter/wheel_agreement.h"
#include "filter/wheel_preintegration.h"
#include "filter/wheels.h"

namespace ear {

class Filter final : public Estimator {
 public:
  /// Throws std::invalid_argument, naming the field, if a setting or the calibration is unusable.
  Filter(const FilterConfig& config, const Calibration& calibration);

  /// Takes a sample in time order. One that is not finite, implausible or not later than the one before is refused and
  /// counted. Its stamps are the clock: after a gap of 2 s, or when they go on from an earlier time, all begins anew.
  void add_imu(const ImuSample& sample) override;

  /// Takes a reading in time order; it is used at its own time when the state passes it. One that is not later than the
  /// one before, far behind the state or far ahead of the inertial samples, is refused and counted. Without a
  /// calibration of its sensor it is ignored.
  void add_encoder(const EncoderSample& sample) override;
  void add_laser(const LaserSample& sample) override;

  /// How the body moved from the last processed frame to a frame stamped `t_ns`: for a front end to track with. Before
  /// the start only the rotation is known. Nothing if no frame came yet, or no samples.
  [[nodiscard]] std::optional<RelativeMotion> motion_to(TimeNs t_ns) const override;

  /// A camera's stamp by the common clock, should the camera's own have jumped; nothing for a frame that is not to be
  /// used, as this is not known yet. For who has the stamps as the driver gives them, once for each frame as it comes.
  [[nodiscard]] std::optional<TimeNs> common_stamp(TimeNs camera_stamp_ns) override;

  /// Takes the features of one frame. The estimate at the frame's time, or nothing while it cannot start. Features that
  /// are not finite, that no camera can see, or that come twice are left out and counted.
  std::optional<Estimate> process(const FeatureFrame& frame) override;

  /// The same at a time without an image, from all other sensors; a camera's stamp. Tracks go on over it. Nothing where
  /// these have nothing to tell: with cameras, off the ground. Images that come late can then still be used.
  std::optional<Estimate> process_without_image(TimeNs t_ns) override;

  /// The newest state carried on by the samples to `t_ns` (IMU time). Nothing before the start, while lost, and later
  /// than 0.5 s after the newest sample.
  [[nodiscard]] std::optional<NavState> predict(TimeNs t_ns) const override;

  [[nodiscard]] Status status() const override;
  [[nodiscard]] const Health& health() const override { return monitor_.health(); }
  /// Keeps no more than so many clones from the next frame on, at least 3 and at most FilterConfig::window.
  void set_window(int clones) override;
  /// Tells the health of a frame that no inertial samples reach.
  void refuse_frame() override;
  [[nodiscard]] InputCounts input_counts() const override;  ///< of samples; frames are the caller's
  /// Are there inertial samples (nearly) up to the frame's time?
  [[nodiscard]] bool covers(TimeNs t_ns) const override;
  [[nodiscard]] bool is_next(TimeNs t_ns) const override;  ///< is a frame with this stamp later than the one before?
  [[nodiscard]] TimeNs camera_time(TimeNs imu_time_ns) const override;  ///< the stamp that the camera has at that time
  [[nodiscard]] CameraState cameras() const override { return state_.camera; }
  [[nodiscard]] OdometerState odometer() const override { return state_.odometer; }
  [[nodiscard]] const State& state() const { return state_; }
  [[nodiscard]] const Covariance& covariance() const { return covariance_; }

 private:
  /// Attitude and velocity at a time near the state's.
  struct Motion {
    Eigen::Matrix3d R_WB;
    Eigen::Vector3d v_W;
  };

  /// Where no inertial samples are, though time passed: a gap, or a clock that jumped.
  struct ImuGap {
    TimeNs from_ns = 0;
    TimeNs to_ns = 0;      ///< at once, if the clock jumped back
    double unseen = 0.0;   ///< [s] that passed
    double doubted = 0.0;  ///< share of it that the covariance knows of
  };

  struct Clocks {
    ImuClock imu;
    StreamClock encoder, camera;
  };

  // filter.cpp
  void take_memory();
  void hear(ImuClock::Stream stream, TimeNs t_ns);
  void take_waiting_imu();
  [[nodiscard]] std::optional<TimeNs> now() const;
  void take_imu(const ImuSample& sample);
  [[nodiscard]] TimeNs imu_time(TimeNs camera_time_ns) const;
  [[nodiscard]] std::optional<TimeNs> state_time() const;
  bool begin_frame(const FeatureFrame& frame, bool frozen);
  void compare_sensors(const FeatureFrame& frame, TimeNs t_ns);
  [[nodiscard]] double trust(MotionSensor sensor) const;
  [[nodiscard]] std::optional<Estimate> finish_frame(bool image, const FrameAgreement& agreement);
  [[nodiscard]] bool possible() const;
  [[nodiscard]] bool usable() const;
  [[nodiscard]] bool on_ground() const { return encoder_ && contact_.mode() == ContactMode::ground; }
  [[nodiscard]] bool sees_ground() const { return beam_count_ > 0; }  ///< are there lasers?
  /// Nothing but the wheels' calibration tells a length: there is neither camera nor laser.
  [[nodiscard]] bool scale_is_given() const {
    return encoder_ && config_.online_calibration.wheels && !sees_ground() && calibration_.cameras.empty();
  }
  [[nodiscard]] ImuErrorMatrix ordinary_covariance() const;
  [[nodiscard]] Estimate make_estimate() const;

  // filter_start.cpp
  void restart(TimeNs t_ns, TimeNs clock_shift);
  bool try_start(TimeNs t_ns, const ImuStatistics& imu, bool still);
  bool try_rolling_start();
  bool try_moving_start(const FeatureFrame& frame);
  bool begin_moving();
  void start_again(const FeatureFrame& frame);
  void join_worlds();
  void stop();
  [[nodiscard]] Eigen::VectorXd start_sigma() const;
  void reset_covariance(const Eigen::VectorXd& sigma);

  // filter_motion.cpp
  void mend_spike(const ImuSample& next);
  void doubt_imu_gap();
  void doubt_imu();
  void doubt_motion(double rotation, double velocity, double position);
  void watch_biases(double dt);
  [[nodiscard]] bool waits_for_bridge() const;
  [[nodiscard]] NavState predict_here(TimeNs t_ns) const;
  void advance(TimeNs t_ns);
  void advance_measuring(TimeNs t_ns);
  [[nodiscard]] Motion motion_at(TimeNs t_ns) const;
  void update(const Eigen::Ref<const Eigen::MatrixXd>& H, int first_column, const Eigen::Ref<const Eigen::VectorXd>& r,
              bool by_image = false);

  // filter_ground.cpp
  [[nodiscard]] Displacement displacement_by_wheels(TimeNs until_ns) const;
  void log_wheels(const WheelRows& rows, const Eigen::Matrix<double, WheelRows::size, 1>& sigma, TimeNs t_ns);
  void note_contact(ContactEvent event);
  [[nodiscard]] bool rolls_at(TimeNs t_ns) const;
  void update_with_wheels(const WheelIncrement& turn);
  bool choose_wheels(WheelRows& rows, Eigen::Vector4d& sigma, const WheelIncrement& turn);
  void start_displacement();
  void add_to_displacement(TimeNs until_ns);
  void update_with_displacement();
  void update_with_beams(const BeamRanges& reading);
  bool restart_ground(const BeamRanges& reading, const Eigen::Matrix3d& R_WB);

  // filter_images.cpp
  [[nodiscard]] bool repeats_last_image(const FeatureFrame& frame) const;
  void note_image(const FeatureFrame& frame);
  [[nodiscard]] Pose image_pose() const;
  [[nodiscard]] Pose motion_since_image() const;
  void bridge(const FeatureFrame& frame);
  [[nodiscard]] double noise_of(const FeatureFrame& frame);
  [[nodiscard]] double feigned_turn(double dt) const;
  [[nodiscard]] FrameAgreement check_frame(const FeatureFrame& frame);
  void go_on_blind(bool still);
  void use_image(const FeatureFrame& frame, bool still);
  void note_features_used();
  void log_features();
  void hold_still();
  void append_clone();
  void make_room(std::optional<std::size_t> leaving);
  void update_with_features(const FeatureFrame& frame, std::optional<std::size_t> leaving);
  bool add_track(const Track& track);
  void add_observation(int clone, std::size_t camera, const InverseDepthPoint& point, const Eigen::Vector2d& uv);
  void select_tracks(const FeatureFrame& frame, std::optional<std::uint64_t> leaving);
  [[nodiscard]] std::optional<std::size_t> clone_to_leave() const;
  [[nodiscard]] double median_parallax_px(const Clone& from, const Clone& to) const;
  [[nodiscard]] int clone_index(std::uint64_t frame) const;

  FilterConfig config_;
  Calibration calibration_;
  double focal_px_ = 0.0;  ///< of the first camera, for thresholds in pixels
  int beam_count_ = 0;
  ChiSquaredGate gate_;

  Status status_ = Status::waiting_for_imu;
  State state_;
  Covariance covariance_;
  Clocks clocks_;
  ImuBuffer imu_;
  InputGuard guard_;
  ImpactGuard impact_guard_;
  std::optional<ImuGap> imu_gap_;            ///< ahead of the state, or around it
  std::optional<TimeNs> doubtful_since_ns_;  ///< inertial samples since the last image may be wrong by more than noise
  std::optional<TimeNs> bridged_ns_;         ///< when images last did
  BiasWatch bias_watch_;
  TimeNs watched_ns_ = 0;                             ///< when it last judged
  Eigen::Vector3d rate_B_ = Eigen::Vector3d::Zero();  ///< mean rate of the last piece integrated, bias removed [rad/s]
  std::optional<EncoderReader> encoder_;
  Ring<WheelIncrement> turns_;                       ///< not yet passed by the state
  Ring<BeamRanges> ranges_;                          ///< the same
  std::optional<WheelIncrement> passed_turn_;        ///< the last one that was
  bool ground_known_ = false;                        ///< the lasers saw the ground since it was last touched
  int misplaced_grounds_ = 0;                        ///< readings in a row whose plane the wheels do not stand on
  int leaning_readings_ = 0;                         ///< readings in a row with an axle that does not lie along it
  std::optional<WheelPreintegration> displacement_;  ///< since the newest clone
  Ring<WheelIncrement> displacement_turns_;          ///< not yet used up by it
  TimeNs displacement_ns_ = 0;                       ///< up to where it goes
  ContactDetector contact_;
  std::array<TimeNs, WheelRows::size> agrees_since_ns_{};  ///< each row of the odometer with the state; kDisagrees
  WheelAgreement wheel_agreement_;
  std::array<TimeNs, 2> wheel_agrees_since_ns_{};  ///< each wheel by itself with the state, while they contradict
  WheelRest wheel_rest_;
  StandstillDetector standstill_;
  TrackTable tracks_;
  std::uint64_t next_frame_ = 0;
  std::size_t window_ = 0;      ///< clones kept for now
  bool right_skipped_ = false;  ///< in the frame at hand
  TimeNs last_frame_ns_ = 0;    ///< camera stamp of the last frame processed
  bool any_frame_ = false;
  Pose image_T_WB_;                                         ///< body at the last image, as it was estimated then
  std::optional<std::uint64_t> image_clone_;                ///< the newest clone then
  Pose image_in_clone_;                                     ///< body at the last image, in that clone
  Eigen::Vector3d image_rate_B_ = Eigen::Vector3d::Zero();  ///< its rate then [rad/s]
  TimeNs last_image_ns_ = 0;                                ///< its camera stamp
  FeatureFrame last_features_;                              ///< its features
  bool any_image_ = false;
  bool noiseless_camera_ = false;   ///< its images repeat while nothing moves: that means nothing
  TimeNs fed_ns_ = 0;               ///< when features last told enough of where the vehicle is
  int fed_features_ = 0;            ///< used since then
  bool clone_is_here_ = false;      ///< the newest clone was made where the vehicle is, if it stands
  bool learn_calibration_ = false;  ///< standing tells nothing about it
  FrameStatistics statistics_;
  ConsistencyCheck consistency_check_;
  CameraDisplacement camera_displacement_;
  Consistency consistency_;  ///< over the interval that ends with the frame at hand
  TimeNs compared_ns_ = 0;   ///< where that ends
  ImageNoise image_noise_;
  double feature_noise_ = 1.0;  ///< standard deviation of the features of the frame at hand, times the usual
  FrameCheck frame_check_;
  HealthMonitor monitor_;
  MovingStart moving_start_;
  std::optional<TimeNs> lifted_ns_;    ///< when the velocity last did not lie in the ground
  Anchor anchor_;                      ///< of the state's world in that of the estimates
  std::optional<Estimate> last_good_;  ///< the last estimate that rested on more than inertia
  SourceLog log_;                      ///< what each sensor measured, against what was expected
  StereoMatches bridge_matches_;
  std::array<double, 2> camera_squares_{};    ///< of this frame's features: residuals of either camera [px^2]
  std::array<int, 2> camera_observations_{};  ///< how many of them, one for each axis

  // Memory that is used again.
  Eigen::MatrixXd rows_;  ///< of measurements between the state and one clone
  FeatureInformation information_;
  std::vector<CameraPose> cameras_;
  std::vector<Sighting> sightings_;
  std::vector<LinearizedObservation> observations_;
  std::vector<std::size_t> selected_;
  std::vector<std::uint64_t> frame_ids_;
  mutable std::vector<double> parallax_;
};

}  // namespace ear
