// A recording fed to the estimator, as its drivers would have done it.
#pragma once

#include <functional>
#include <optional>

#include "ear/odometry.h"
#include "src/recording/recording.h"

namespace ear::tools {

/// What became of one stereo frame, or of a step without one. `estimate` is empty while the estimator has not started.
struct ReplayedFrame {
  TimeNs t_ns = 0;
  std::optional<Estimate> estimate;
};

/// Feeds every sample of the recording to `odometry`. A frame is handed over when the first inertial sample after it is
/// in: images take longer to arrive than inertial samples. While no images come, a vehicle with wheels is stepped at 20
/// Hz. Calls `on_frame` after each; `before_sample` before each sample and `after_sample` after it, if there are any.
void replay(Recording& recording, Odometry& odometry, const std::function<void(const ReplayedFrame&)>& on_frame,
            const std::function<void(const Sample&)>& before_sample = nullptr,
            const std::function<void(const Sample&)>& after_sample = nullptr);

}  // namespace ear::tools
