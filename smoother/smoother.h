// The paper's own estimator, to compare the filter with: sliding-window bundle adjustment over the same samples and
// tracks. The filter's ingest, sources, starts and health; in place of its updates, a window. docs/smoother.md.
//
// Per frame (Smoother::step): compare the sensors, measure the interval since the frame before, append the frame,
// minimise (1), and make room in the window.
#pragma once

#include <memory>
#include <optional>

#include "filter/common_estimator.h"
#include "smoother/interval_meter.h"
#include "smoother/window.h"

namespace ear::smoother {

class Smoother final : public CommonEstimator {
 public:
  /// Throws std::invalid_argument, naming the field, if a setting or the calibration is unusable: there must be
  /// cameras, and wheels are used with OdometerModel::terrain and lasers, or not at all.
  Smoother(const FilterConfig& config, const Calibration& calibration);

  std::optional<Estimate> process(const FeatureFrame& frame) override;
  /// On the ground, as a frame without features.
  std::optional<Estimate> process_without_image(TimeNs t_ns) override;

  [[nodiscard]] Status status() const override;
  [[nodiscard]] FrameStamp check_stamp(TimeNs t_ns) const override;
  /// It takes the time it takes.
  void set_window(int /*clones*/) override {}

 private:
  FrameAgreement move_to(const FeatureFrame& frame, bool image);
  void start(const FeatureFrame& frame, TimeNs t_ns);
  FrameAgreement step(const FeatureFrame& frame, TimeNs t_ns, bool image);
  void stop();
  void restart(TimeNs t_ns, TimeNs clock_shift) override;
  void make_room(TimeNs t_ns) override;
  void note(ContactEvent event) override;
  [[nodiscard]] std::optional<Estimate> report(bool image, const FrameAgreement& seen);

  // Of the common parts, the filter starts, and then has the newest frame as the window knows it: for sources, health
  // and the estimate. The sources see contact, standing, displacements and the images; they update a start only.
  IntervalMeter meter_;
  std::unique_ptr<Window> window_;  ///< once it has started
};

}  // namespace ear::smoother
