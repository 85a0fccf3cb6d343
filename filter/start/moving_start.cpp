#include "filter/start/moving_start.h"

#include <utility>

#include "filter/ekf/initial_state.h"
#include "filter/ingest/limits.h"

namespace ear {
namespace {

constexpr std::size_t kFewestFrames = 8;  // chosen: that solve() takes, whatever their rate

}  // namespace

MovingStart::MovingStart(const FilterConfig& config, const Calibration& calibration)
    : noise_{start_sigma(config.prior, calibration), calibration.imu,
             config.feature_sigma_px / focal_length(calibration)} {}

void MovingStart::add(TimeNs t_ns, const FeatureFrame& frame, const ImuBuffer& imu) {
  if (frame.repeated) return;
  if (!frames_.empty() && seconds_between(frames_.back().t_ns, t_ns) >= kStale) frames_.clear();
  if (frames_.empty() && (imu.empty() || imu[0].t_ns > t_ns)) return;
  frames_.push_back({t_ns, frame});
  while (spans_enough(1)) frames_.erase(frames_.begin());
}

bool MovingStart::spans_enough(std::size_t first) const {
  return frames_.size() >= first + kFewestFrames &&
         seconds_between(frames_[first].t_ns, frames_.back().t_ns) >= kStartSpan;
}

StartAttempt MovingStart::solve(const ImuBuffer& imu, const CameraState& cameras) {
  if (!spans_enough()) return {std::nullopt, Reason::few_frames};
  const TimeNs now_ns = frames_.back().t_ns;
  if (tried_ns_ && now_ns > *tried_ns_ && seconds_between(*tried_ns_, now_ns) < kStartSpan / kFewestFrames) {
    return {std::nullopt, lacked_};
  }
  tried_ns_ = now_ns;
  StartAttempt attempt = image_start(frames_, imu, cameras, noise_);
  lacked_ = attempt.lacks;
  return attempt;
}

}  // namespace ear
