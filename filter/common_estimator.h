// What every estimator does alike, the filter and what is compared with it: samples in, starts, questions, and what is
// given away of the state. What happens to a frame is their own: filter.cpp.
#pragma once

#include <optional>
#include <vector>

#include "ear/calibration.h"
#include "ear/estimate.h"
#include "ear/filter_config.h"
#include "ear/types.h"
#include "filter/advice.h"
#include "filter/ekf/ekf.h"
#include "filter/ekf/records.h"
#include "filter/estimator.h"
#include "filter/health/consistency.h"
#include "filter/health/health_monitor.h"
#include "filter/ingest/ingest.h"
#include "filter/sources/sources.h"
#include "filter/start/map_alignment.h"
#include "filter/start/start.h"

namespace ear {

class CommonEstimator : public Estimator {
 public:
  void start_at(const GivenStart& start) final;
  void add_imu(const ImuSample& sample) final;
  void add_encoder(const EncoderSample& given) final;
  void add_laser(const LaserSample& given) final;
  [[nodiscard]] std::optional<RelativeMotion> motion_to(TimeNs t_ns) const final;
  [[nodiscard]] std::optional<TimeNs> common_stamp(TimeNs camera_stamp_ns) final;
  [[nodiscard]] std::optional<NavState> predict(TimeNs t_ns) const final;
  [[nodiscard]] const Health& health() const final { return health_.health(); }
  void refuse_frame() final;
  [[nodiscard]] InputCounts input_counts() const final { return ingest_.counts(); }
  [[nodiscard]] CalibrationState calibration() const final { return {ekf_.state().camera, ekf_.state().odometer}; }
  void report_tracks(std::vector<TrackOutcome>* outcomes) final { records_.outcomes = outcomes; }

 protected:
  /// Usable settings and calibration.
  CommonEstimator(const FilterConfig& config, const Calibration& calibration);

  /// As after construction, but for the clocks, and where the vehicle was last known to be. The stamps before are to be
  /// moved by `clock_shift` [ns]; the first of the samples that follow is at `t_ns`.
  void succeed(CommonEstimator& before, TimeNs t_ns, TimeNs clock_shift);
  /// Nothing of the state is used any more.
  void forget_state();

  /// Counts start from zero, and the sources look at the frame before anything is done with it. Its IMU time.
  TimeNs begin_frame(const FeatureFrame& frame);
  /// How the sensors are to be used over the interval that ends with the frame.
  [[nodiscard]] Advice advice() const { return advise(consistency_, health_.health(), config_.anomaly); }

  /// After the frame: the estimate, if there is a state. `ground_known`: the lasers have seen its normal.
  /// `scales`: those that nothing measures.
  [[nodiscard]] std::optional<Estimate> make_estimate(bool ground_known, const UnseenScales& scales) const;
  /// What the health monitor reads of it. `image`: false without one.
  [[nodiscard]] HealthMonitor::Frame health_frame(bool image, const FrameAgreement& seen,
                                                  const std::optional<Estimate>& estimate) const;
  /// The estimate, if it may be given away.
  [[nodiscard]] std::optional<Estimate> give(std::optional<Estimate> estimate);

  FilterConfig config_;
  Calibration calibration_;
  Ingest ingest_;
  Ekf ekf_;
  Sources sources_;
  Start start_;
  ConsistencyCheck consistency_check_;
  HealthMonitor health_;
  MapAlignment alignment_;               ///< of the state's world in that of the estimates
  std::optional<Estimate> last_good_;    ///< the last that rested on more than inertia, or the first
  std::optional<TimeNs> last_frame_ns_;  ///< camera stamp of the last frame processed
  Records records_;                      ///< of the frame at hand
  Consistency consistency_;              ///< over the interval that ends with it

 private:
  /// All begins anew: succeed().
  virtual void restart(TimeNs t_ns, TimeNs clock_shift) = 0;
  /// The state moves on to `t_ns`: samples or readings up to there make room.
  virtual void make_room(TimeNs t_ns) = 0;
  /// The wheels left the ground, or met it, or nothing happened.
  virtual void note(ContactEvent /*event*/) {}

  /// Another sensor's reading comes in.
  void hear(ImuClock::Stream stream, TimeNs stamp_ns);
  void take_imu();

  LaserSample laser_;  ///< the one that comes in, by the clock of the IMU; its memory is used again
};

}  // namespace ear
