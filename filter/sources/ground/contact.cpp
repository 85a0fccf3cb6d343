#include "filter/sources/ground/contact.h"

#include <algorithm>
#include <cmath>

#include "filter/ekf/initial_state.h"
#include "filter/ingest/limits.h"

namespace ear {
namespace {

constexpr double kOtherGround = 0.2;  // [m] chosen: over which the ground becomes another

}  // namespace

ContactDetector::ContactDetector(const FilterConfig& config, const Calibration& calibration) : config_(config.contact) {
  if (!calibration.encoder) return;
  if (!has_beams(calibration)) {
    mode_ = ContactMode::ground;
    return;
  }
  y_B_ = calibration.encoder->T_BO.linear().col(1);
  ground_.emplace(*calibration.lasers, *calibration.encoder, config.odometer);
  wheel_radius_ = {calibration.encoder->wheel_radius[0], calibration.encoder->wheel_radius[1]};
}

ContactEvent ContactDetector::add_imu(const ImuSample& sample) {
  if (!ground_) return ContactEvent::none;
  if (last_imu_ns_ && sample.t_ns <= *last_imu_ns_) return ContactEvent::none;
  const double dt = last_imu_ns_ ? seconds_between(*last_imu_ns_, sample.t_ns) : 0.0;
  last_imu_ns_ = sample.t_ns;

  const Eigen::Vector3d angle_B = dt * (sample.gyro_B - b_g_);
  ground_->turn(angle_B, sample.accel_B, dt);
  body_angle_ += angle_B.dot(y_B_);
  if (mode_ != ContactMode::ground) ground_->move(kFlightSpeed * dt);

  if (std::abs(sample.accel_B.norm() + kGravity_W.z()) > config_.strike) {
    strike_ns_ = sample.t_ns;
    ground_->strike();
  }
  return look_for_strike(sample.t_ns);
}

ContactEvent ContactDetector::add_wheels(const WheelIncrement& increment) {
  if (!ground_) return ContactEvent::none;
  roll(increment);
  return look_for_strike(increment.to_ns);
}

ContactEvent ContactDetector::add_laser(const LaserSample& sample) {
  if (!ground_) return ContactEvent::none;
  const int agreeing = ground_->update(sample);
  if (agreeing > 0) seen_ns_ = sample.t_ns;
  switch (mode_) {
    case ContactMode::unknown:
      if (lasts(height_known(), sample.t_ns, kLanding)) {
        return change(ground_->height() < config_.confirmed_height ? ContactMode::ground : ContactMode::air,
                      sample.t_ns);
      }
      break;
    case ContactMode::ground:
      if (lasts(airborne(agreeing), sample.t_ns, config_.takeoff_duration))
        return change(ContactMode::air, sample.t_ns);
      break;
    case ContactMode::air:
      if (lasts(stands(), sample.t_ns, config_.touchdown_duration)) return change(ContactMode::ground, sample.t_ns);
      break;
  }
  return look_for_strike(sample.t_ns);
}

/// On the ground every metre rolled is new ground: another normal, another height of the wheels over the plane. The
/// faster wheel counts, backwards too; what the body turned about the axle is part of the reading.
void ContactDetector::roll(const WheelIncrement& increment) {
  const double distance =
      wheel_radius_.cwiseProduct((increment.angle.array() + body_angle_).matrix()).cwiseAbs().maxCoeff();
  body_angle_ = 0.0;
  recent_distance_ = recent_distance_ * std::exp(-increment.duration() / kStreamGap) + distance;
  if (mode_ != ContactMode::ground || distance == 0.0) return;
  ground_->move(distance);
  ground_->suppose_height(level_, config_.takeoff_height * std::sqrt(kOtherGround / distance));
  const double level = level_ + (1.0 - std::exp(-distance / kOtherGround)) * (ground_->height() - level_);
  level_ = std::clamp(level, -config_.touchdown_height, config_.touchdown_height);
}

/// There must be two beams that agree (one, where but one sees anything). Where not all agree, or the wheels rolled
/// just now, the ground may be uneven.
bool ContactDetector::airborne(int agreeing) const {
  const bool all = agreeing == ground_->beams();
  const double unknown = all ? std::min(1.0, recent_distance_ / kOtherGround) : 1.0;
  const double tolerance = config_.takeoff_height + config_.unevenness * unknown;
  return agreeing >= std::clamp(ground_->beams_that_see(), 1, 2) &&
         ground_->height() - 2.0 * ground_->height_sigma() > level_ + tolerance;
}

bool ContactDetector::stands() const {
  return std::max(ground_->height_sigma(), ground_->height()) < config_.touchdown_height &&
         std::abs(ground_->climb()) < config_.touchdown_climb;
}

/// Something struck the vehicle while it is low, as beams show that measure, and not before it left the ground.
ContactEvent ContactDetector::look_for_strike(TimeNs t_ns) {
  if (mode_ != ContactMode::air) return ContactEvent::none;
  const bool struck = strike_ns_ > since_ns_ && seconds_between(*strike_ns_, t_ns) < kLanding;
  const bool silent = !seen_ns_ || seconds_between(*seen_ns_, t_ns) > kStreamGap;
  const bool low = height_known() && ground_->height() < config_.confirmed_height;
  return struck && low && !silent ? change(ContactMode::ground, t_ns) : ContactEvent::none;
}

bool ContactDetector::height_known() const { return ground_->height_sigma() < config_.confirmed_height; }

bool ContactDetector::lasts(bool holds, TimeNs t_ns, double duration) {
  if (!holds) {
    holds_since_ns_.reset();
    return false;
  }
  if (!holds_since_ns_) holds_since_ns_ = t_ns;
  return seconds_between(*holds_since_ns_, t_ns) >= duration;
}

ContactEvent ContactDetector::change(ContactMode mode, TimeNs t_ns) {
  const bool first = mode_ == ContactMode::unknown;
  mode_ = mode;
  if (!first) since_ns_ = t_ns;
  holds_since_ns_.reset();
  if (mode == ContactMode::ground) {
    level_ = std::clamp(ground_->height(), -config_.touchdown_height, config_.touchdown_height);
    recent_distance_ = kOtherGround;  // on new ground
  }
  if (first) return ContactEvent::none;
  return mode == ContactMode::ground ? ContactEvent::touchdown : ContactEvent::takeoff;
}

}  // namespace ear
