// The filter, with an ear for all that goes into it: what a batch estimate needs of a recording.
#pragma once

#include "calibration/drive.h"
#include "filter/filter.h"

namespace ear::calibration {

class DriveRecorder final : public Estimator {
 public:
  /// `drive` is filled, and must outlive this.
  DriveRecorder(const FilterConfig& config, const Calibration& calibration, Drive& drive)
      : filter_(config, calibration), drive_(drive) {}

  void start_at(const GivenStart& start) override { filter_.start_at(start); }
  void add_imu(const ImuSample& sample) override;
  void add_encoder(const EncoderSample& sample) override;
  void add_laser(const LaserSample& sample) override;

  [[nodiscard]] std::optional<RelativeMotion> motion_to(TimeNs t_ns) const override { return filter_.motion_to(t_ns); }
  [[nodiscard]] std::optional<TimeNs> common_stamp(TimeNs stamp_ns) override { return filter_.common_stamp(stamp_ns); }
  std::optional<Estimate> process(const FeatureFrame& frame) override;
  std::optional<Estimate> process_without_image(TimeNs t_ns) override { return filter_.process_without_image(t_ns); }
  [[nodiscard]] std::optional<NavState> predict(TimeNs t_ns) const override { return filter_.predict(t_ns); }

  [[nodiscard]] Status status() const override { return filter_.status(); }
  [[nodiscard]] const Health& health() const override { return filter_.health(); }
  void refuse_frame() override { filter_.refuse_frame(); }
  void set_window(int clones) override { filter_.set_window(clones); }
  [[nodiscard]] InputCounts input_counts() const override { return filter_.input_counts(); }
  [[nodiscard]] FrameStamp check_stamp(TimeNs t_ns) const override { return filter_.check_stamp(t_ns); }
  [[nodiscard]] CalibrationState calibration() const override { return filter_.calibration(); }

 private:
  Filter filter_;
  Drive& drive_;
};

}  // namespace ear::calibration
