// What the images show of the cameras: do they come, in time, with enough features where these should be?
#pragma once

#include <optional>
#include <utility>

#include "ear/estimate.h"
#include "ear/types.h"
#include "filter/health/fault_state.h"
#include "filter/sources/cameras/frame_agreement.h"

namespace ear {

/// By how much a sensor's stamps are off those of the inertial samples, against what is usual.
class StampWatch {
 public:
  /// A stamp of the sensor. It is unusual if it differs from the newest inertial one by more than is usual; when this
  /// one came is known to within the interval before it.
  void add(TimeNs stamp_ns);
  /// A reading came that is far ahead of the inertial samples. False: the second one since the last of these.
  bool add_ahead() { return !std::exchange(ahead_, true); }
  /// An inertial sample; `after_loss`: others were lost before it. False: none were, and a reading was ahead.
  [[nodiscard]] bool add_imu(TimeNs t_ns, bool after_loss);

  [[nodiscard]] bool unusual() const { return unusual_; }
  /// Unusual, and behind.
  [[nodiscard]] bool late() const { return unusual_ && !ahead_; }
  [[nodiscard]] std::optional<TimeNs> newest_imu() const { return imu_ns_; }

 private:
  std::optional<TimeNs> imu_ns_;  ///< the newest inertial sample
  double imu_step_ = 0.0;         ///< [s] since the one before
  bool ahead_ = false;            ///< a reading was, since then
  bool unusual_ = false;          ///< the last reading
  TimeNs came_ns_ = 0;            ///< it, by the inertial samples
  int count_ = 0;
  double usual_ = 0.0;     ///< [s]
  double variance_ = 0.0;  ///< [s^2] of the distance from it
};

class ImageHealth {
 public:
  /// `cameras`: 0 to 2.
  explicit ImageHealth(std::size_t cameras) : cameras_(cameras) {}

  /// Whether an image may be used, by how it agrees with what the state and the other sensors expect of it: not left
  /// and right exchanged, not one with a stamp that jumped; a late one is right.
  [[nodiscard]] bool check(const FrameAgreement& seen, TimeNs t_ns);

  /// An image at `t_ns`, after it was used or not. `running`: there is a state.
  void add(TimeNs t_ns, bool running, const FrameAgreement& seen, const FrameStatistics& statistics);
  /// An image came too far ahead of the inertial samples to be used. False: the second one since the last of these.
  bool add_ahead() { return stamps_.add_ahead(); }
  /// An inertial sample, which shows whether an image was ahead, or `after_loss`: of other samples.
  void hear_imu(TimeNs t_ns, bool after_loss);
  /// No image came for too long.
  void add_silence(TimeNs t_ns);
  /// Something that never happens to sound cameras.
  void report(TimeNs t_ns);

  [[nodiscard]] bool any() const { return cameras_ > 0; }
  /// Did one come not long ago?
  [[nodiscard]] bool come(TimeNs t_ns) const;
  /// Do the images carry the estimate? They may where some of what they show is wrong, and where they come late but
  /// fit.
  [[nodiscard]] bool carry() const { return carrying_.sound() || late_; }
  /// Did the gate refuse most features of the last second? With one camera nothing else shows a state that is wrong.
  [[nodiscard]] bool misfit() const;
  [[nodiscard]] const FaultState& left() const { return left_; }
  [[nodiscard]] const FaultState& right() const { return right_; }

 private:
  /// What an image usually shows.
  struct Usual {
    double tracks = 0.0;
    double stereo = 0.0;  ///< share of them that both cameras see
    int images = 0;
  };

  void judge(TimeNs t_ns, bool running, const FrameAgreement& seen, const FrameStatistics& statistics);

  std::size_t cameras_;
  FaultState left_, right_;
  FaultState carrying_;  ///< less strict
  StampWatch stamps_;
  bool stamps_wrong_ = false;
  bool late_ = false;                 ///< the last image came late, and fits
  TimeNs last_ns_ = 0;                ///< of the images
  std::optional<TimeNs> arrival_ns_;  ///< the newest inertial stamp when the last one came
  double interval_ = 0.0;             ///< [s] usual
  Usual usual_;
  double used_ = 0.0, rejected_ = 0.0;  ///< features, recent ones
};

}  // namespace ear
