#include "src/mavlink/odometry_stream.h"

#include <algorithm>
#include <cmath>

namespace ear::mavlink {
namespace {

constexpr double kMinRate = 30.0;            // [Hz] below, PX4's EKF2 may not use the messages
constexpr double kMinInterval = 0.9 / 50.0;  // [s] 50 Hz, and a tenth for jitter
constexpr double kMaxPrediction =
    0.25;  // [s] after a frame; with no frame since, the estimate is not vision's any more
constexpr int kQualityPerFeature = 2;
constexpr int kWeakQuality = 20;
constexpr int kGoodQuality = 30;  // hysteresis: a weak estimate is good again from here on

/// Messages per frame, so that there are 30 a second; a camera of 29 Hz needs no second one.
int messages_per_frame(double frame_interval) {
  return std::max(1, static_cast<int>(std::ceil(kMinRate * frame_interval - 0.1)));
}

}  // namespace

StatusText to_text(Health health) {
  switch (health) {
    case Health::starting:
      return {Severity::notice, "ear: not started, stand still"};
    case Health::good:
      return {Severity::notice, "ear: tracking"};
    case Health::weak:
      return {Severity::warning, "ear: tracking, but few features in view"};
    case Health::lost:
      return {Severity::critical, "ear: lost, no odometry"};
  }
  return {};
}

SystemState to_system_state(Health health) {
  switch (health) {
    case Health::starting:
      return SystemState::calibrating;
    case Health::good:
    case Health::weak:
      return SystemState::active;
    case Health::lost:
      return SystemState::critical;
  }
  return SystemState::critical;
}

int quality_of(const FrameStatistics& frame) {
  return frame.standing ? 100 : std::clamp(kQualityPerFeature * frame.tracks, 1, 100);
}

OdometryStream::OdometryStream(const Eigen::Matrix3d& R_BV, const ImuCalibration& imu)
    : R_BV_(R_BV), rate_variance_(imu.gyro_noise * imu.gyro_noise * imu.rate_hz) {}

void OdometryStream::add_imu(const ImuSample& sample) {
  samples_[0] = samples_[1];
  samples_[1] = sample;
}

std::optional<OdometryMessage> OdometryStream::add_frame(const std::optional<Estimate>& estimate, Status status) {
  const Health before = health_;
  health_ = health_after(estimate, status);
  if (!estimate) {
    if (status != Status::tracking) last_.reset();
    return std::nullopt;
  }
  if (before == Health::lost) ++reset_counter_;

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
         since_frame < std::min(*frame_interval_ - 0.5 * step, kMaxPrediction);
}

OdometryMessage OdometryStream::add_prediction(const NavState& state) { return make_message(state); }

Health OdometryStream::health_after(const std::optional<Estimate>& estimate, Status status) const {
  if (!estimate) {
    // One frame that could not be used, or an estimator that gave up?
    return status == Status::tracking || health_ == Health::starting ? health_ : Health::lost;
  }
  const int quality = quality_of(estimate->frame);
  return quality < (health_ == Health::weak ? kGoodQuality : kWeakQuality) ? Health::weak : Health::good;
}

OdometryMessage OdometryStream::make_message(const NavState& state) {
  OdometryMessage message = make_odometry(state, rate_B(state), R_BV_);
  set_covariances(message, state, last_->covariance, rate_variance_, R_BV_);
  message.reset_counter = reset_counter_;
  message.quality = static_cast<std::int8_t>(quality_of(last_->frame));
  last_sent_ns_ = state.t_ns;
  return message;
}

Eigen::Vector3d OdometryStream::rate_B(const NavState& state) const {
  if (!samples_[1]) return Eigen::Vector3d::Zero();
  if (!samples_[0]) return samples_[1]->gyro_B - state.b_g;
  const double whole = seconds_between(samples_[0]->t_ns, samples_[1]->t_ns);
  const double part = std::clamp(seconds_between(samples_[0]->t_ns, state.t_ns) / whole, 0.0, 1.0);
  return (1.0 - part) * samples_[0]->gyro_B + part * samples_[1]->gyro_B - state.b_g;
}

}  // namespace ear::mavlink
