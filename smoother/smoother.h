// The paper's own estimator, to compare the filter with: sliding-window bundle adjustment over the same samples and
// tracks. The filter's ingest, sources, starts and health; in place of its updates, a window. docs/smoother.md.
//
// Per frame (Smoother::step): compare the sensors, measure the interval since the frame before, append the frame,
// minimise (1), and make room in the window.
#pragma once

#include <memory>
#include <optional>

#include "ear/calibration.h"
#include "ear/filter_config.h"
#include "filter/ekf/ekf.h"
#include "filter/estimator.h"
#include "filter/health/consistency.h"
#include "filter/health/health_monitor.h"
#include "filter/ingest/ingest.h"
#include "filter/sources/sources.h"
#include "filter/start/map_alignment.h"
#include "filter/start/start.h"
#include "smoother/interval_meter.h"
#include "smoother/window.h"

namespace ear::smoother {

class Smoother final : public Estimator {
 public:
  /// Throws std::invalid_argument, naming the field, if a setting or the calibration is unusable: there must be
  /// cameras, and wheels are used with OdometerModel::terrain and lasers, or not at all.
  Smoother(const FilterConfig& config, const Calibration& calibration);

  void start_at(const GivenStart& start) override;
  void add_imu(const ImuSample& sample) override;
  void add_encoder(const EncoderSample& sample) override;
  void add_laser(const LaserSample& sample) override;

  [[nodiscard]] std::optional<RelativeMotion> motion_to(TimeNs t_ns) const override;
  [[nodiscard]] std::optional<TimeNs> common_stamp(TimeNs camera_stamp_ns) override;
  std::optional<Estimate> process(const FeatureFrame& frame) override;
  /// On the ground, as a frame without features.
  std::optional<Estimate> process_without_image(TimeNs t_ns) override;
  [[nodiscard]] std::optional<NavState> predict(TimeNs t_ns) const override;

  [[nodiscard]] Status status() const override;
  [[nodiscard]] const Health& health() const override { return health_.health(); }
  void refuse_frame() override;
  /// It takes the time it takes.
  void set_window(int /*clones*/) override {}
  [[nodiscard]] InputCounts input_counts() const override { return ingest_.counts(); }
  [[nodiscard]] FrameStamp check_stamp(TimeNs t_ns) const override;
  [[nodiscard]] TimeNs camera_time(TimeNs imu_time_ns) const override;
  [[nodiscard]] CalibrationState calibration() const override { return {ekf_.state().camera, ekf_.state().odometer}; }

 private:
  void take_imu();
  void restart(TimeNs t_ns, TimeNs clock_shift);
  FrameAgreement move_to(const FeatureFrame& frame, bool image);
  void start(const FeatureFrame& frame, TimeNs t_ns);
  FrameAgreement step(const FeatureFrame& frame, TimeNs t_ns, bool image);
  void stop();
  [[nodiscard]] std::optional<Estimate> report(bool image, const FrameAgreement& agreement);

  FilterConfig config_;
  Calibration calibration_;
  Ingest ingest_;
  Ekf ekf_;  ///< starts; from then on the newest frame as the window knows it, for sources, health and the estimate
  Sources sources_;  ///< contact, standing, displacements, agreement of the images; they update a start only
  Start start_;
  ConsistencyCheck consistency_check_;
  HealthMonitor health_;
  IntervalMeter meter_;
  std::unique_ptr<Window> window_;     ///< once it has started
  MapAlignment alignment_;             ///< of the window's world in that of the estimates
  std::optional<Estimate> last_good_;  ///< the last estimate that rested on more than inertia
  std::optional<TimeNs> last_frame_ns_;
  Records records_;          ///< of the frame at hand
  Consistency consistency_;  ///< over the interval that ends with it
};

}  // namespace ear::smoother
