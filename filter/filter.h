// The estimator: inertial samples, wheel and laser readings and feature tracks in, state and covariance out. An MSCKF
// with right-invariant error.
//
// What happens to a frame is Filter::process, in filter.cpp: read that first. The parts:
//   ingest/    samples become usable: clocks, plausibility, buffers, quality of the inertial samples
//   ekf/       the state and its covariance: propagate, test (the gate), apply, clone, marginalise
//   kernels/   its sums over many rows, for each vector unit with the same bits
//   sources/   cameras, wheels, ground, standstill: each turns samples into linearised measurements
//   start/     standing, rolling, moving: where it begins
//   health/    what is reported of all that, and which sensor is at fault (13)-(15)
#pragma once

#include <optional>

#include "filter/common_estimator.h"
#include "filter/health/bias_watch.h"
#include "filter/ingest/ring.h"

namespace ear {

class Filter final : public CommonEstimator {
 public:
  /// Throws std::invalid_argument, naming the field, if a setting or the calibration is unusable.
  Filter(const FilterConfig& config, const Calibration& calibration);

  std::optional<Estimate> process(const FeatureFrame& frame) override;
  std::optional<Estimate> process_without_image(TimeNs t_ns) override;

  [[nodiscard]] Status status() const override;
  [[nodiscard]] FrameStamp check_stamp(TimeNs t_ns) const override;
  void set_window(int clones) override { sources_.cameras().set_window(clones); }
  [[nodiscard]] const Ekf& ekf() const { return ekf_; }

 private:
  void wait_for_imu(const FeatureFrame& frame);
  std::optional<Estimate> process_usable(const FeatureFrame& frame);
  void propagate_to(const FeatureFrame& frame);
  void watch_biases();
  void take_in(const ImuExcess& excess);
  void take_in(const BiasJump& jump, TimeNs t_ns);
  void start(const FeatureFrame& frame);
  void stop();
  void restart(TimeNs t_ns, TimeNs clock_shift) override;
  void make_room(TimeNs t_ns) override;
  [[nodiscard]] std::optional<Estimate> report(bool image, const FrameAgreement& seen);

  BiasWatch bias_watch_;
  Ring<FeatureFrame> waiting_;                      ///< for inertial samples
  Status without_state_ = Status::waiting_for_imu;  ///< the status while there is no state
};

}  // namespace ear
