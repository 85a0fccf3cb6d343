// Samples in: one clock a stream, plausibility, buffers, and the quality of the inertial samples. What comes out can be
// used. A sample that is late, early, false or missing is dealt with here. docs/ingest.md.
#pragma once

#include <optional>

#include "ear/calibration.h"
#include "ear/estimate.h"
#include "ear/filter_config.h"
#include "ear/types.h"
#include "filter/ingest/beam_ranges.h"
#include "filter/ingest/even_clock.h"
#include "filter/ingest/impact_guard.h"
#include "filter/ingest/imu_buffer.h"
#include "filter/ingest/imu_clock.h"
#include "filter/ingest/imu_interruption.h"
#include "filter/ingest/imu_spike.h"
#include "filter/ingest/input_guard.h"
#include "filter/ingest/ring.h"
#include "filter/ingest/stream_clock.h"
#include "filter/ingest/wheel_increment.h"

namespace ear {

/// One reading of wheels or lasers whose time has come: exactly one of the two.
struct Measurement {
  TimeNs t_ns = 0;                          ///< when its middle was, or the time of the ranges
  std::optional<WheelIncrement> increment;  ///< as stamped
  BeamRanges ranges;
};

class Ingest {
 public:
  Ingest(const FilterConfig& config, const Calibration& calibration);

  /// Inertial samples go in here as their drivers stamped them, and stamps of the other streams as they come; what
  /// comes out goes to judge() and store().
  [[nodiscard]] ImuClock& imu_clock() { return imu_clock_; }
  /// `has_state`: one that has to pass the gaps; else the last of them counts alone.
  [[nodiscard]] ImuVerdict judge(const ImuSample& sample, bool has_state);
  /// Into the buffer. What only a fault of a sensor does: a spike (of the samples before), a clipped value.
  ImuFault store(const ImuSample& sample, const ImuVerdict& verdict);

  /// What becomes of a reading: the wheels' increment since the one before, by the common clock.
  struct Encoders {
    Verdict verdict = Verdict::mistimed;
    std::optional<WheelIncrement> increment;
  };
  /// `state_ns`: time of the state, if there is one.
  [[nodiscard]] Encoders take(EncoderSample sample, std::optional<TimeNs> state_ns);
  [[nodiscard]] Verdict judge(const LaserSample& sample, std::optional<TimeNs> state_ns) {
    return guard_.judge(sample, state_ns);
  }
  /// A camera's stamp by the common clock; nothing while that is not known.
  [[nodiscard]] std::optional<TimeNs> camera_stamp(TimeNs stamp_ns) {
    return camera_clock_.correct(stamp_ns, now(), imu_interval());
  }
  [[nodiscard]] const FeatureFrame& plausible(const FeatureFrame& frame) { return guard_.plausible(frame); }

  /// If the buffer of inertial samples is full: the time up to which the state has to go before the next one.
  [[nodiscard]] std::optional<TimeNs> imu_due() const;
  /// Readings wait here until the state passes them. If the queue is full now: the time up to which the state has to go
  /// before the next one. Without a state, the oldest make room.
  [[nodiscard]] std::optional<TimeNs> push(const WheelIncrement& increment, bool has_state);
  [[nodiscard]] std::optional<TimeNs> push(const BeamRanges& ranges, bool has_state);
  /// The next one that is not later than `t_ns`, in time order. `encoder_offset` [s] is added to the wheels' times.
  [[nodiscard]] std::optional<Measurement> next(TimeNs t_ns, double encoder_offset);
  /// All that are earlier.
  void drop_before(TimeNs t_ns);
  void drop_readings();

  /// Nothing is known of the samples before; clocks and counts go on.
  void restart();

  /// Are there inertial samples (nearly) up to this time?
  [[nodiscard]] bool covers(TimeNs imu_time_ns) const;
  [[nodiscard]] WheelIncrements increments() const { return {passed_increment_, increments_}; }
  [[nodiscard]] const Ring<WheelIncrement>& waiting_increments() const { return increments_; }
  [[nodiscard]] const ImuBuffer& imu() const { return imu_; }
  /// Are the newest inertial samples in doubt? They may be those of a spike, whose end the next few show. A state that
  /// goes on without an image waits for it: none would put right what it takes of them.
  [[nodiscard]] bool waits_for_imu(std::optional<TimeNs> state_ns) const;
  /// Factor on the accelerometer's white noise, 1 or more, as its samples show it.
  [[nodiscard]] double white_accel() const { return spikes_.white_accel(); }
  [[nodiscard]] ImuInterruption& interruption() { return interruption_; }
  [[nodiscard]] InputCounts counts() const;

 private:
  [[nodiscard]] std::optional<TimeNs> now() const;
  /// Between the last two inertial samples [s].
  [[nodiscard]] double imu_interval() const;

  FilterConfig config_;
  Calibration calibration_;
  ImuClock imu_clock_;
  StreamClock encoder_clock_, camera_clock_;
  EvenClock even_clock_;
  InputGuard guard_;
  ImpactGuard impact_guard_;
  ImuSpikes spikes_;
  ImuBuffer imu_;
  ImuInterruption interruption_;
  std::optional<EncoderReader> encoder_;
  Ring<WheelIncrement> increments_;                 ///< not yet passed by the state
  Ring<BeamRanges> ranges_;                         ///< the same
  std::optional<WheelIncrement> passed_increment_;  ///< the last one that was
};

}  // namespace ear
