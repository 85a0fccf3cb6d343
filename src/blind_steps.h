// When to ask the estimator for a step because no image comes.
#pragma once

#include <algorithm>
#include <limits>

#include "ear/types.h"

namespace ear {

/// A step that is due now goes to this time: of a frame with this stamp, `frame_ns`, if that is earlier. Frames that
/// come later by their clock would else lie before the step for ever, and be refused.
[[nodiscard]] inline TimeNs step_time(TimeNs now_ns, TimeNs frame_ns) { return std::min(now_ns, frame_ns); }

/// Without images the wheels carry on: always on a vehicle without a camera, else while images are missing. Without
/// wheels there is nothing but inertia, and its estimate would be no more than a plausible lie. Times are IMU times.
class BlindSteps {
 public:
  BlindSteps(bool has_camera, bool has_wheels) : has_wheels_(has_wheels), missing_from_ns_(has_camera ? kNever : 0) {}

  void saw_frame(TimeNs t_ns) {
    const TimeNs interval = t_ns - last_frame_ns_;  // of a slow camera no frame is missing yet
    if (interval > 0 && interval < kSlowest) patience_ = std::max(kPatience, interval + interval / 2);
    last_frame_ns_ = t_ns;
    missing_from_ns_ = t_ns + patience_;
  }

  /// Whether a step is due now; then the next one is due kStep later.
  [[nodiscard]] bool due(TimeNs t_ns) {
    if (!has_wheels_ || t_ns < missing_from_ns_ || t_ns < next_step_ns_) return false;
    next_step_ns_ = t_ns + kStep;
    return true;
  }

 private:
  static constexpr TimeNs kNever = std::numeric_limits<TimeNs>::max();
  static constexpr TimeNs kStep = 50'000'000;       // between estimates without images
  static constexpr TimeNs kPatience = 150'000'000;  // so long after the last image the next one is missing, at least
  static constexpr TimeNs kSlowest = 400'000'000;   // longer intervals between images are outages

  bool has_wheels_;
  TimeNs last_frame_ns_ = 0;
  TimeNs patience_ = kPatience;
  TimeNs missing_from_ns_;  // before the first image of a camera nothing is missing
  TimeNs next_step_ns_ = 0;
};

}  // namespace ear
