// The paper's own estimator, to compare the filter with: sliding-window bundle adjustment over the same samples and
// tracks, with the filter's guards, start, decisions and models. docs/smoother.md.
//
// Per frame (Smoother::process): pre-integrate the inertial samples and the wheels since the frame before, append the
// frame, minimise (1), say what came out, and make room in the window.
#pragma once

#include <array>
#include <memory>
#include <optional>

#include "ear/calibration.h"
#include "ear/filter_config.h"
#include "filter/ekf/covariance.h"
#include "filter/ekf/gate.h"
#include "filter/estimator.h"
#include "filter/filter.h"
#include "filter/health/consistency.h"
#include "filter/ingest/impact_guard.h"
#include "filter/ingest/imu_buffer.h"
#include "filter/ingest/input_guard.h"
#include "filter/ingest/ring.h"
#include "filter/sources/cameras/camera_displacement.h"
#include "filter/sources/ground/contact.h"
#include "filter/sources/standstill/standstill_detector.h"
#include "filter/sources/wheels/wheel_rows.h"
#include "filter/start/map_alignment.h"
#include "smoother/ground_normal.h"
#include "smoother/window.h"

namespace ear::smoother {

class Smoother final : public Estimator {
 public:
  /// Throws std::invalid_argument, naming the field, if a setting or the calibration is unusable: there must be
  /// cameras, and wheels are used with OdometerModel::terrain and lasers, or not at all.
  Smoother(const FilterConfig& config, const Calibration& calibration);

  void add_imu(const ImuSample& sample) override;
  void add_encoder(const EncoderSample& sample) override;
  void add_laser(const LaserSample& sample) override;

  [[nodiscard]] std::optional<RelativeMotion> motion_to(TimeNs t_ns) const override;
  /// Clocks are taken for right.
  [[nodiscard]] std::optional<TimeNs> common_stamp(TimeNs camera_stamp_ns) override { return camera_stamp_ns; }
  std::optional<Estimate> process(const FeatureFrame& frame) override;
  /// On the ground, as a frame without features.
  std::optional<Estimate> process_without_image(TimeNs t_ns) override;
  [[nodiscard]] std::optional<NavState> predict(TimeNs t_ns) const override;

  [[nodiscard]] Status status() const override;
  /// Tracking or lost, what carries the estimate, and how well it knows where it is. Nothing of single sensors.
  [[nodiscard]] const Health& health() const override { return health_; }
  void refuse_frame() override {}
  /// It takes the time it takes.
  void set_window(int /*clones*/) override {}
  [[nodiscard]] InputCounts input_counts() const override { return guard_.counts(); }
  [[nodiscard]] FrameStamp check_stamp(TimeNs t_ns) const override;
  [[nodiscard]] TimeNs camera_time(TimeNs imu_time_ns) const override;
  [[nodiscard]] CalibrationState calibration() const override;

 private:
  // smoother.cpp
  [[nodiscard]] TimeNs imu_time(TimeNs camera_time_ns) const;
  [[nodiscard]] std::optional<TimeNs> state_time() const;
  [[nodiscard]] bool on_ground() const { return encoder_ && contact_.mode() == ContactMode::ground; }
  [[nodiscard]] bool rolls_at(TimeNs t_ns) const;
  void note_contact(ContactEvent event);
  void go_on_from(const Estimate& last);
  void begin_anew();
  void lose(TimeNs t_ns);
  std::optional<Estimate> start(const FeatureFrame& frame);
  std::optional<Estimate> step(const FeatureFrame& frame);
  void begin_statistics(const FeatureFrame& frame);
  std::optional<Estimate> reported();

  // smoother_motion.cpp
  void compare_sensors(const FeatureFrame& frame, const ImuState& x, TimeNs t_ns);
  void tell_covariance(const ImuState& x);
  [[nodiscard]] NewFrame moved_to(const FeatureFrame& frame, const ImuState& x, TimeNs t_ns);
  [[nodiscard]] double trust(MotionSensor sensor) const;
  [[nodiscard]] ImuPreintegration preintegrate(const ImuState& x, TimeNs t_ns);
  [[nodiscard]] std::optional<WheelDisplacement> roll(const ImuState& x, TimeNs t_ns);
  [[nodiscard]] std::optional<WheelDisplacement> integrate_wheels(const ImuState& x, TimeNs t_ns);
  [[nodiscard]] bool add_wheel_noise(WheelDisplacement& z, TimeNs t_ns);
  bool take_ranges(TimeNs until_ns);
  void move_normal(TimeNs t_ns);
  [[nodiscard]] Eigen::Matrix3d gyro_rotation(TimeNs from_ns, TimeNs to_ns) const;
  void forget_passed(TimeNs t_ns);

  // smoother_output.cpp
  [[nodiscard]] NavState predict_here(TimeNs t_ns) const;
  [[nodiscard]] Estimate make_estimate() const;
  [[nodiscard]] TerrainEstimate terrain() const;
  void judge(const Estimate& estimate);

  FilterConfig config_;
  Calibration calibration_;
  double focal_px_;
  Gate gate_;
  InputGuard guard_;
  ImpactGuard impact_guard_;
  ImuBuffer imu_;
  std::optional<EncoderReader> encoder_;
  Ring<WheelIncrement> turns_;  ///< not yet passed by the newest frame
  std::optional<WheelIncrement> passed_turn_;
  Ring<BeamRanges> ranges_;  ///< not yet used
  ContactDetector contact_;
  WheelRest wheel_rest_;
  StandstillDetector standstill_;
  ConsistencyCheck consistency_check_;
  CameraDisplacement camera_displacement_;
  Displacements displacements_;
  Consistency consistency_;
  GroundNormal normal_;
  TimeNs normal_ns_ = 0;  ///< up to where it was moved
  double speed_ = 0.0;    ///< of the wheels of late [m/s]
  Eigen::Vector3d b_g_ = Eigen::Vector3d::Zero();
  std::array<TimeNs, 3> agrees_since_ns_{};  ///< the wheels with the inertial samples: forward, sideways, upwards

  std::unique_ptr<Filter> starter_;  ///< until it has started
  std::optional<Window> window_;     ///< from then on
  std::optional<NewestCovariance> covariance_;
  Covariance P_;  ///< of the newest frame as the filter's functions know it
  bool was_still_ = false;
  bool any_frame_ = false;
  TimeNs last_frame_ns_ = 0;
  std::optional<Pose> image_T_WB_;
  TimeNs last_image_ns_ = 0;
  FrameStatistics statistics_;
  Health health_;
  MapAlignment alignment_;  ///< of the window's world in that of the estimates
  std::optional<Estimate> last_good_;
};

}  // namespace ear::smoother
