// The last second or two of a vehicle that moves, in the air or without wheels, until a start is found in them.
// docs/filter.md, "Starts".
#pragma once

#include <optional>
#include <vector>

#include "ear/filter_config.h"
#include "ear/types.h"
#include "filter/ekf/state.h"
#include "filter/ingest/imu_buffer.h"
#include "filter/start/image_start.h"

namespace ear {

/// [s] chosen: of what a start in motion takes.
inline constexpr double kStartSpan = 1.5;

/// Keeps the frames of the last seconds.
class MovingStart {
 public:
  MovingStart(const FilterConfig& config, const Calibration& calibration);

  /// The next frame, at IMU time `t_ns`. One that repeats the last, or comes long after it, shows no motion: what came
  /// before is forgotten.
  void add(TimeNs t_ns, const FeatureFrame& frame, const ImuBuffer& imu);

  /// Are the frames kept enough for solve(), from this one on?
  [[nodiscard]] bool spans_enough(std::size_t first = 0) const;

  /// A state at the first frame kept, by image_start(); none while the frames span too little. Tried five times a
  /// second.
  [[nodiscard]] StartAttempt solve(const ImuBuffer& imu, const CameraState& cameras);

  [[nodiscard]] const std::vector<TimedFrame>& frames() const { return frames_; }
  void clear() { frames_.clear(); }

 private:
  StartNoise noise_;
  std::vector<TimedFrame> frames_;  ///< oldest first
  std::optional<TimeNs> tried_ns_;  ///< the last time
  Reason lacked_ = Reason::none;    ///< then
};

}  // namespace ear
