// The estimator: inertial samples, wheel and laser readings and feature tracks in, state and covariance out. An MSCKF
// with right-invariant error.
//
// What happens to a frame is Filter::process, in filter.cpp: read that first. The parts:
//   ingest/    samples become usable: clocks, plausibility, buffers, quality of the inertial samples
//   ekf/       the state and its covariance: propagate, apply (the gate), clone, marginalise
//   kernels/   its sums over many rows, for each vector unit with the same bits
//   sources/   cameras, wheels, ground, standstill: each turns samples into linearised measurements
//   start/     standing, rolling, moving: where it begins
//   health/    what is reported of all that, and which sensor is at fault (13)-(15)
#pragma once

#include <optional>

#include "ear/calibration.h"
#include "ear/estimate.h"
#include "ear/filter_config.h"
#include "ear/types.h"
#include "filter/ekf/ekf.h"
#include "filter/estimator.h"
#include "filter/health/bias_watch.h"
#include "filter/health/consistency.h"
#include "filter/health/health_monitor.h"
#include "filter/ingest/ingest.h"
#include "filter/sources/sources.h"
#include "filter/start/map_alignment.h"
#include "filter/start/start.h"

namespace ear {

class Filter final : public Estimator {
 public:
  /// Throws std::invalid_argument, naming the field, if a setting or the calibration is unusable.
  Filter(const FilterConfig& config, const Calibration& calibration);

  /// Begins at a state that is given: see Odometry::start_at.
  void start_at(const GivenStart& start) override;

  /// Takes a sample in time order. One that is not finite, implausible or not later than the one before is refused and
  /// counted. Its stamps are the clock: after a gap of 2 s, or when they go on from an earlier time, all begins anew.
  void add_imu(const ImuSample& sample) override;

  /// Takes a reading in time order; it is used at its own time when the state passes it. One that is not later than the
  /// one before, far behind the state or far ahead of the inertial samples, is refused and counted. Without a
  /// calibration of its sensor it is ignored.
  void add_encoder(const EncoderSample& sample) override;
  void add_laser(const LaserSample& sample) override;

  /// How the body moved from the last image to a frame stamped `t_ns`: for a front end to track with. Before the start
  /// only the rotation is known. Nothing if no image came yet, or no samples.
  [[nodiscard]] std::optional<RelativeMotion> motion_to(TimeNs t_ns) const override;

  /// A camera's stamp by the common clock, should the camera's own have jumped; nothing for a frame that is not to be
  /// used, as this is not known yet. For who has the stamps as the driver gives them, once for each frame as it comes.
  [[nodiscard]] std::optional<TimeNs> common_stamp(TimeNs camera_stamp_ns) override;

  /// Takes the features of one frame. The estimate at the frame's time, or nothing while it cannot start. Features that
  /// are not finite, that no camera can see, or that come twice are left out and counted.
  std::optional<Estimate> process(const FeatureFrame& frame) override;

  /// The same at a time without an image, from all other sensors; a camera's stamp. Tracks go on over it. Nothing where
  /// these show nothing: with cameras, off the ground. Images that come late can then still be used.
  std::optional<Estimate> process_without_image(TimeNs t_ns) override;

  /// The newest state carried on by the samples to `t_ns` (IMU time). Nothing before the start, while lost, and later
  /// than 0.5 s after the newest sample.
  [[nodiscard]] std::optional<NavState> predict(TimeNs t_ns) const override;

  [[nodiscard]] Status status() const override;
  [[nodiscard]] const Health& health() const override { return health_.health(); }
  /// Keeps no more than so many clones from the next frame on, at least 3 and at most FilterConfig::window.
  void set_window(int clones) override { sources_.cameras().set_window(clones); }
  /// Reports a frame that no inertial samples reach.
  void refuse_frame() override;
  [[nodiscard]] InputCounts input_counts() const override { return ingest_.counts(); }  ///< of samples
  [[nodiscard]] FrameStamp check_stamp(TimeNs t_ns) const override;
  [[nodiscard]] TimeNs camera_time(TimeNs imu_time_ns) const override;  ///< the stamp that the camera has at that time
  [[nodiscard]] CalibrationState calibration() const override { return {ekf_.state().camera, ekf_.state().odometer}; }
  [[nodiscard]] const Ekf& ekf() const { return ekf_; }

 private:
  void propagate_to(const FeatureFrame& frame);
  void start(const FeatureFrame& frame);
  void stop();
  void restart(TimeNs t_ns, TimeNs clock_shift);
  void take_imu();
  [[nodiscard]] std::optional<Estimate> report(bool image, const FrameAgreement& agreement);

  FilterConfig config_;
  Calibration calibration_;
  Ingest ingest_;
  Ekf ekf_;
  Sources sources_;
  Start start_;
  ConsistencyCheck consistency_check_;
  BiasWatch bias_watch_;
  HealthMonitor health_;
  MapAlignment alignment_;                          ///< of the state's world in that of the estimates
  std::optional<Estimate> last_good_;               ///< the last estimate that rested on more than inertia
  Status without_state_ = Status::waiting_for_imu;  ///< the status while there is no state
  std::optional<TimeNs> last_frame_ns_;             ///< camera stamp of the last frame processed
  Records records_;                                 ///< of the frame at hand
  Consistency consistency_;                         ///< over the interval that ends with it
};

}  // namespace ear
