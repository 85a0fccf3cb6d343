// Whether a sample can be true, before anything is done with it; what cannot is refused and counted. docs/ingest.md.
#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "ear/calibration.h"
#include "ear/estimate.h"
#include "ear/types.h"
#include "filter/ingest/repeat_guard.h"
#include "filter/ingest/stamp_guard.h"
#include "filter/ingest/wheel_increment.h"

namespace ear {

struct ImuVerdict {
  bool accepted = false;
  bool repeated = false;     ///< refused: the driver had no new one, as if it had been lost
  bool begins_anew = false;  ///< after a gap of 2 s, or with another clock: where the vehicle is now nobody knows
  double interval = 0.0;     ///< [s] the usual one
  int lost = 0;              ///< samples between this one and the one before, by their usual interval
  bool gap = false;          ///< too long since the one before
  double unseen = 0.0;       ///< [s] since the sample before, if the clock may have jumped instead
  double refused = 0.0;      ///< [s] that passed while samples were refused
  TimeNs clock_shift = 0;    ///< what the stamps before are to be moved by, if the clock was set back [ns]
};

enum class Verdict : std::uint8_t {
  accepted,
  impossible,  ///< no sound sensor delivers it
  mistimed     ///< not later than the one before, or far from the inertial samples
};

class InputGuard {
 public:
  explicit InputGuard(const Calibration& calibration);

  [[nodiscard]] ImuVerdict judge(const ImuSample& sample);

  /// `state_ns`: time of the state, if there is one. `reader`, which did not see the reading yet, begins anew where
  /// readings are missing, and where the wheels turned faster than wheels do.
  [[nodiscard]] Verdict judge(const EncoderSample& sample, std::optional<TimeNs> state_ns, EncoderReader& reader);
  [[nodiscard]] Verdict judge(const LaserSample& sample, std::optional<TimeNs> state_ns);

  /// The frame without the features that cannot be, such as one in a right image where there is one camera; the frame
  /// itself if there are none. Valid until the next call.
  [[nodiscard]] const FeatureFrame& plausible(const FeatureFrame& frame);

  /// A reading whose stamp jumped, before it is known why.
  Verdict refuse_encoder();
  /// Are the inertial samples refused, for stamps that are not later?
  [[nodiscard]] bool refuses_imu() const { return imu_stamps_.refuses(); }

  /// The filter begins anew: forgets the readings, but not the inertial clock nor the counts.
  void restart();

  [[nodiscard]] const InputCounts& counts() const { return counts_; }
  void count_spike() { ++counts_.imu_spikes; }

 private:
  [[nodiscard]] bool takes_stamp(TimeNs t_ns, std::optional<TimeNs> state_ns, std::optional<TimeNs>& last_ns,
                                 StreamCounts& counts) const;

  double imu_interval_;  ///< the usual one: the median [s]
  bool stereo_;
  std::size_t beam_count_;
  InputCounts counts_;
  StampGuard imu_stamps_;
  RepeatGuard imu_repeats_;
  std::optional<TimeNs> last_encoder_ns_;  ///< the newest reading accepted
  std::optional<TimeNs> last_laser_ns_;    ///< the same
  FeatureFrame plausible_frame_;
  std::vector<std::uint64_t> ids_;
};

}  // namespace ear
