// What an embedding program includes: samples in, estimates out.
//
//   ear::Odometry odometry(ear::Config{}, calibration);
//   odometry.add_imu(sample);                              // as they arrive; so for encoders and lasers
//   if (const auto estimate = odometry.add_stereo(frame))  // once per frame
//     use(estimate->state.p_WB, estimate->covariance);
//
// Samples -> ingest -> front end -> filter -> Estimate. Single-threaded: one thread calls at a time.
#pragma once

#include <functional>
#include <memory>
#include <optional>

#include "ear/calibration.h"
#include "ear/config.h"
#include "ear/estimate.h"
#include "ear/given_start.h"
#include "ear/types.h"

namespace ear {

/// The present time [s], of any origin: what the time that frames take is measured with.
using Clock = std::function<double()>;

class Odometry {
 public:
  /// Throws std::invalid_argument, naming the field, if the calibration or a setting is unusable. `clock`: where
  /// PerformanceConfig::budget_ms is measured; by default that of the machine.
  Odometry(const Config& config, const Calibration& calibration, Clock clock = {});
  ~Odometry();
  Odometry(Odometry&&) noexcept;
  Odometry& operator=(Odometry&&) noexcept;

  /// Begins at the first frame or step that is not earlier than the state given, which the inertial samples carry
  /// there, whatever the other sensors show; until then there is no other start. Where the inertial samples do not
  /// reach back to its time, there is none at all: Health::reason. Another call replaces it. Throws
  /// std::invalid_argument, naming the field, as checked() does, and where there is an estimate already.
  void start_at(const GivenStart& start);

  /// Samples of each sensor come in time order, and should be there before the first frame that is later.
  void add_imu(const ImuSample& sample);
  void add_encoder(const EncoderSample& sample);
  void add_laser(const LaserSample& sample);

  /// The estimate at the frame's time, or nothing while the estimator cannot start (see status()). Inertial samples up
  /// to the frame's time should be there; where the last ones are missing, the newest one is held. Nothing either for a
  /// frame that is left out to keep PerformanceConfig::budget_ms, or in flight for an image that repeats the one before
  /// to the byte, which shows nothing new; predict() goes on.
  std::optional<Estimate> add_stereo(const StereoFrame& frame);

  /// When a frame with this stamp was taken [ns, IMU time], by what is known so far of the cameras' clock: so long it
  /// should wait for inertial samples. One that they do not reach by 40 ms is refused.
  [[nodiscard]] TimeNs frame_time(TimeNs stamp_ns) const;

  /// The estimate at a time without an image [ns, IMU time], from all other sensors: for vehicles without a camera,
  /// while images do not come, and between them; tracks go on over it. Nothing with cameras, off the ground: see
  /// predict(). Nor while the newest inertial samples, up to five, may be a spike: the next step counts them rightly.
  std::optional<Estimate> step(TimeNs t_ns);

  /// The newest state, carried on by the inertial samples since to `t_ns` (IMU time). Nothing before the start or lost.
  [[nodiscard]] std::optional<NavState> predict(TimeNs t_ns) const;

  [[nodiscard]] Status status() const;
  /// The same as in the last estimate, and what changed since: also where there is no estimate.
  [[nodiscard]] Health health() const;
  [[nodiscard]] InputCounts input_counts() const;
  [[nodiscard]] StageTimes stage_times() const;
  /// Of the last image that was looked at; none before the first.
  [[nodiscard]] FeatureFrame features() const;

  /// The calibration in use: what was given, with what was learned while running.
  [[nodiscard]] Calibration calibration() const;

  /// Back to the state after construction.
  void reset();

 private:
  class Impl;
  friend class OdometryFactory;  // src/odometry_factory.h: with another estimator in place of the filter
  explicit Odometry(std::unique_ptr<Impl> impl);

  std::unique_ptr<Impl> impl_;
};

}  // namespace ear
