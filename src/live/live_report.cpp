#include "src/live/live_report.h"

#include "src/health_text.h"
#include "src/log/log.h"

namespace ear::live {

void LiveReport::take(const LiveFrame& frame, const Odometry& odometry) {
  const std::lock_guard lock(mutex_);
  const bool changed = frame.health.load_step != load_step_;
  load_step_ = frame.health.load_step;
  health_ = to_text(frame.health);
  ++frames_;
  estimates_ += frame.estimate ? 1 : 0;
  imu_ = odometry.input_counts().imu;
  if (changed) log_info("load step " + std::to_string(load_step_) + (load_step_ > 0 ? ": work is left out" : ""));
}

std::string LiveReport::health() const {
  const std::lock_guard lock(mutex_);
  return health_;
}

std::string LiveReport::summary() const {
  const std::lock_guard lock(mutex_);
  return std::to_string(frames_) + " frames and steps, " + std::to_string(estimates_) + " estimates, " +
         std::to_string(samples_) + " inertial samples, " + std::to_string(imu_.rejected()) + " of these refused";
}

}  // namespace ear::live
