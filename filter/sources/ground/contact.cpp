#include "filter/sources/ground/contact.h"

#include <algorithm>
#include <cmath>

namespace ear {
namespace {

constexpr double kConfirmation = 0.1;  // [s] chosen: of evidence for the first mode; after a strike, to confirm one
constexpr double kJustNow = 0.3;  // [s] chosen: of the distance rolled, for the tolerance; and of beams that measure
constexpr double kOtherGround = 0.2;  // [m] chosen: over which the ground becomes another
constexpr double kLevelSigma = 0.02;  // [m] chosen: of the wheels' height; the beams see it ten times meanwhile
constexpr double kLevelTime = 2.0;    // [s] chosen: the same for a vehicle at rest
constexpr double kAirSpeed = 1.0;     // [m/s] chosen: at which the ground passes below a flying vehicle

}  // namespace

ContactDetector::ContactDetector(const ContactConfig& config, const Calibration& calibration) : config_(config) {
  if (!calibration.encoder) return;
  if (!calibration.lasers || calibration.lasers->beams.empty()) {
    mode_ = ContactMode::ground;
    return;
  }
  y_B_ = calibration.encoder->T_BO.linear().col(1);
  ground_.emplace(*calibration.lasers, *calibration.encoder);
  wheel_radius_ = {calibration.encoder->wheel_radius[0], calibration.encoder->wheel_radius[1]};
}

std::optional<TimeNs> ContactDetector::since_ns() const {
  return since_ns_ == kNever ? std::nullopt : std::optional(since_ns_);
}

ContactEvent ContactDetector::add_imu(const ImuSample& sample) {
  if (!ground_ || !sample.gyro_B.allFinite() || !sample.accel_B.allFinite()) return ContactEvent::none;
  if (sample.t_ns <= last_imu_ns_) return ContactEvent::none;
  const bool first = last_imu_ns_ == kNever;
  const double dt = first ? 0.0 : seconds_between(last_imu_ns_, sample.t_ns);
  last_imu_ns_ = sample.t_ns;

  const Eigen::Vector3d angle_B = dt * (sample.gyro_B - b_g_);
  ground_->turn(angle_B, sample.accel_B, dt);
  body_angle_ += angle_B.dot(y_B_);
  if (mode_ != ContactMode::ground) ground_->move(kAirSpeed * dt);

  if (std::abs(sample.accel_B.norm() + kGravity_W.z()) > config_.strike) {
    strike_ns_ = sample.t_ns;
    ground_->strike();
  }
  return look_for_confirmed_touchdown(sample.t_ns);
}

ContactEvent ContactDetector::add_wheels(const WheelIncrement& increment) {
  if (!ground_) return ContactEvent::none;
  roll(increment);
  return look_for_confirmed_touchdown(increment.to_ns);
}

ContactEvent ContactDetector::add_laser(const LaserSample& sample) {
  if (!ground_) return ContactEvent::none;
  const GroundTracker::Sighting sighting = ground_->update(sample);
  if (sighting.agreeing > 0) seen_ns_ = sample.t_ns;
  switch (mode_) {
    case ContactMode::unknown:
      return look_for_first_evidence(sample.t_ns);
    case ContactMode::ground:
      return look_for_takeoff(sighting, sample.t_ns);
    case ContactMode::air:
      return look_for_touchdown(sample.t_ns);
  }
  return ContactEvent::none;
}

/// On the ground every metre rolled is new ground: another normal, another height of the wheels over the plane. The
/// faster wheel counts, backwards too; what the body turned about the axle is part of the reading.
void ContactDetector::roll(const WheelIncrement& increment) {
  const double dt = increment.duration();
  const double distance =
      wheel_radius_.cwiseProduct((increment.angle.array() + body_angle_).matrix()).cwiseAbs().maxCoeff();
  body_angle_ = 0.0;
  recent_distance_ = recent_distance_ * std::exp(-dt / kJustNow) + distance;
  if (mode_ != ContactMode::ground) return;
  ground_->move(distance);
  const double renewals = distance / (0.1 * kOtherGround) + dt / kLevelTime;
  ground_->suppose_height(level_, kLevelSigma / std::sqrt(renewals));
  const double share = 1.0 - std::exp(-distance / kOtherGround - dt / kLevelTime);
  const double level = level_ + share * (ground_->height() - level_);
  level_ = std::clamp(level, -config_.touchdown_height, config_.touchdown_height);
}

/// How far the wheels may seem to be above `level_` without being in the air.
double ContactDetector::tolerance(bool all_agree) const {
  const double unknown = all_agree ? std::min(1.0, recent_distance_ / kOtherGround) : 1.0;
  return config_.takeoff_height + config_.unevenness * unknown;
}

ContactEvent ContactDetector::look_for_first_evidence(TimeNs t_ns) {
  if (!lasts(height_known(), t_ns, kConfirmation)) return ContactEvent::none;
  return change(ground_->height() < config_.confirmed_height ? ContactMode::ground : ContactMode::air, t_ns);
}

/// Every beam in use must see the ground below the wheels, and there must be two (one, where there is but
/// one).
ContactEvent ContactDetector::look_for_takeoff(const GroundTracker::Sighting& sighting, TimeNs t_ns) {
  const double lowest = ground_->height() - 2.0 * ground_->height_sigma();
  const bool airborne = sighting.agreeing >= std::min(2, ground_->beams()) &&
                        lowest > level_ + tolerance(sighting.agreeing == ground_->beams()) &&
                        sighting.lowest_lift > level_ + 0.5 * config_.takeoff_height;
  if (!lasts(airborne, t_ns, config_.takeoff_duration)) return ContactEvent::none;
  return change(ContactMode::air, t_ns);
}

ContactEvent ContactDetector::look_for_touchdown(TimeNs t_ns) {
  const bool standing = ground_->height_sigma() < config_.touchdown_height &&
                        ground_->height() < config_.touchdown_height &&
                        std::abs(ground_->climb()) < config_.touchdown_climb;
  if (lasts(standing, t_ns, config_.touchdown_duration)) return change(ContactMode::ground, t_ns);
  return look_for_confirmed_touchdown(t_ns);
}

/// Something struck the vehicle while it is low, as beams show that measure, and not before it left the ground.
ContactEvent ContactDetector::look_for_confirmed_touchdown(TimeNs t_ns) {
  if (mode_ != ContactMode::air) return ContactEvent::none;
  const bool struck = strike_ns_ > since_ns_ && seconds_between(strike_ns_, t_ns) < kConfirmation;
  const bool silent = seconds_between(seen_ns_, t_ns) > kJustNow;
  const bool low = height_known() && ground_->height() < config_.confirmed_height;
  return struck && low && !silent ? change(ContactMode::ground, t_ns) : ContactEvent::none;
}

bool ContactDetector::height_known() const { return ground_->height_sigma() < config_.confirmed_height; }

bool ContactDetector::lasts(bool holds, TimeNs t_ns, double duration) {
  if (!holds) {
    holds_since_ns_ = kNever;
    return false;
  }
  if (holds_since_ns_ == kNever) holds_since_ns_ = t_ns;
  return seconds_between(holds_since_ns_, t_ns) >= duration;
}

ContactEvent ContactDetector::change(ContactMode mode, TimeNs t_ns) {
  const bool first = mode_ == ContactMode::unknown;
  mode_ = mode;
  since_ns_ = t_ns;
  holds_since_ns_ = kNever;
  if (mode == ContactMode::ground) {
    level_ = std::clamp(ground_->height(), -config_.touchdown_height, config_.touchdown_height);
    recent_distance_ = kOtherGround;  // on new ground
  }
  if (first) return ContactEvent::none;
  return mode == ContactMode::ground ? ContactEvent::touchdown : ContactEvent::takeoff;
}

}  // namespace ear
