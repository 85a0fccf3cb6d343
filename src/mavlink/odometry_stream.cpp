#include "src/mavlink/odometry_stream.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <string>

namespace ear::mavlink {
namespace {

constexpr double kMinRate = 30.0;            // [Hz] below, PX4's EKF2 may not use the messages
constexpr double kMinInterval = 0.9 / 50.0;  // [s] 50 Hz, and a tenth for jitter
constexpr double kMaxUnsupported =
    0.25;  // [s] after a frame; with no frame since, the estimate is not vision's any more
constexpr int kWeakQuality = 20;
constexpr int kGoodQuality = 30;  // hysteresis: a weak estimate is good again from here on

/// Messages per frame, so that there are 30 a second; a camera of 29 Hz needs no second one.
int messages_per_frame(double frame_interval) {
  return std::max(1, static_cast<int>(std::ceil(kMinRate * frame_interval - 0.1)));
}

struct Part {
  const char* name;
  Source first, last;
};
constexpr std::array<Part, 5> kParts{{{"cameras", Source::camera_left, Source::camera_right},
                                      {"wheels", Source::wheel_left, Source::wheel_right},
                                      {"beams", Source::beam_0, Source::beam_2},
                                      {"gyro", Source::gyroscope, Source::gyroscope},
                                      {"accel", Source::accelerometer, Source::accelerometer}}};

std::string without(const SourceSet& faulty) {
  std::string text = "ear: without";
  const char* separator = " ";
  for (const Part& part : kParts) {
    bool any = false;
    for (std::size_t i = index_of(part.first); i <= index_of(part.last); ++i) any = any || faulty[i];
    if (!any) continue;
    text += separator + std::string(part.name);
    separator = ", ";
  }
  return text;
}

}  // namespace

StatusText to_text(LinkHealth health, const SourceSet& faulty) {
  switch (health) {
    case LinkHealth::starting:
      return {Severity::notice, "ear: not started"};
    case LinkHealth::good:
      return {Severity::notice, "ear: tracking"};
    case LinkHealth::weak:
      return {Severity::warning, faulty.any() ? without(faulty) : "ear: tracking, but few features in view"};
    case LinkHealth::lost:
      return {Severity::critical, "ear: lost, no odometry"};
  }
  return {};
}

SystemState to_system_state(LinkHealth health) {
  switch (health) {
    case LinkHealth::starting:
      return SystemState::calibrating;
    case LinkHealth::good:
    case LinkHealth::weak:
      return SystemState::active;
    case LinkHealth::lost:
      return SystemState::critical;
  }
  return SystemState::critical;
}

OdometryStream::OdometryStream(const Eigen::Matrix3d& R_BV, const ImuCalibration& imu)
    : R_BV_(R_BV), rate_variance_(imu.gyro_noise * imu.gyro_noise * imu.rate_hz) {}

std::optional<OdometryMessage> OdometryStream::add_frame(const std::optional<Estimate>& estimate, Status status) {
  if (estimate && estimate->health.aiding != Aiding::none) last_supported_ns_ = estimate->state.t_ns;
  const LinkHealth before = health_;
  health_ = health_after(estimate, status);
  if (health_ == LinkHealth::lost) last_.reset();
  if (!estimate || health_ == LinkHealth::lost) return std::nullopt;
  if (before == LinkHealth::lost) ++reset_counter_;

  frame_interval_.reset();
  if (last_) frame_interval_ = seconds_between(last_->state.t_ns, estimate->state.t_ns);
  const bool too_soon = last_ && seconds_between(last_sent_ns_, estimate->state.t_ns) < kMinInterval;
  last_ = estimate;
  if (too_soon) return std::nullopt;
  return make_message(estimate->state);
}

bool OdometryStream::wants_prediction(TimeNs t_ns) const {
  if (!last_ || !frame_interval_) return false;
  const double step = *frame_interval_ / messages_per_frame(*frame_interval_);
  const double since_frame = seconds_between(last_->state.t_ns, t_ns);
  return seconds_between(last_sent_ns_, t_ns) >= step &&
         since_frame < std::min(*frame_interval_ - 0.5 * step, kMaxUnsupported);
}

OdometryMessage OdometryStream::add_prediction(const NavState& state) { return make_message(state); }

LinkHealth OdometryStream::health_after(const std::optional<Estimate>& estimate, Status status) const {
  if (!estimate) {
    // One frame that could not be used, or an estimator that gave up?
    return status == Status::tracking || health_ == LinkHealth::starting ? health_ : LinkHealth::lost;
  }
  if (seconds_between(last_supported_ns_, estimate->state.t_ns) > kMaxUnsupported) return LinkHealth::lost;
  const Health& health = estimate->health;
  const int least = health_ == LinkHealth::weak ? kGoodQuality : kWeakQuality;
  return health.faulty.any() || health.quality < least ? LinkHealth::weak : LinkHealth::good;
}

OdometryMessage OdometryStream::make_message(const NavState& state) {
  OdometryMessage message = make_odometry(state, rates_.gyro_B(state.t_ns) - state.b_g, R_BV_);
  set_covariances(message, state, last_->covariance, rate_variance_, R_BV_);
  message.reset_counter = reset_counter_;
  message.quality = static_cast<std::int8_t>(last_->health.quality);
  last_sent_ns_ = state.t_ns;
  return message;
}

}  // namespace ear::mavlink
