#include "filter/contact.h"

#include <algorithm>
#include <cmath>

namespace ear {
namespace {

constexpr double kGravity = 9.81;           // [m/s^2]
constexpr double kFreeFall = 3.0;           // [m/s^2] less specific force than this, and nothing carries the vehicle
constexpr double kFallDuration = 0.04;      // [s]
constexpr double kSpinUp = 0.5;             // [rad/s] within kSpinUpTime: no free wheel gets faster by itself
constexpr double kSpinUpTime = 0.1;         // [s]
constexpr double kConfirmation = 0.1;       // [s] a strike or spin-up confirms so long
constexpr double kRecent = 0.3;             // [s] the way rolled in this time counts for the tolerance
constexpr double kRecentWay = 0.2;          // [m] after so much the ground may be as uneven as it gets
constexpr double kLevelWay = 0.2;           // [m] over which the ground's shape changes
constexpr double kLevelTime = 2.0;          // [s] the same for a vehicle at rest
constexpr double kLongestImuGap = 0.1;      // [s]
constexpr double kLongestEncoderGap = 0.1;  // [s]
constexpr double kAirSpeed = 1.0;           // [m/s] at which the ground passes below a flying vehicle
constexpr double kFirstDuration = 0.1;      // [s] of evidence for the first mode
constexpr double kSilence = 0.3;            // [s] without a reading that agrees, the beams say nothing
constexpr double kHeightKnown = 0.05;       // [m]
constexpr double kNormalKnown = 0.087;      // [rad]

}  // namespace

ContactDetector::ContactDetector(const ContactConfig& config, const Calibration& calibration) : config_(config) {
  if (!calibration.encoder) return;
  axle_ = *calibration.encoder;
  if (calibration.lasers && !calibration.lasers->beams.empty()) {
    ground_.emplace(*calibration.lasers, axle_);
  } else {
    mode_ = ContactMode::ground;
  }
}

std::optional<TimeNs> ContactDetector::since_ns() const {
  return since_ns_ == kNever ? std::nullopt : std::optional(since_ns_);
}

std::optional<double> ContactDetector::height() const {
  if (!ground_ || ground_->height_sigma() > kHeightKnown) return std::nullopt;
  return ground_->height();
}

std::optional<Eigen::Vector3d> ContactDetector::n_B() const {
  if (!ground_ || ground_->normal_sigma() > kNormalKnown) return std::nullopt;
  return ground_->n_B();
}

ContactEvent ContactDetector::add_imu(const ImuSample& sample) {
  if (!ground_ || !sample.gyro_B.allFinite() || !sample.accel_B.allFinite()) return ContactEvent::none;
  const double dt = seconds_between(last_imu_ns_, sample.t_ns);
  const bool first = last_imu_ns_ == kNever;
  if (!first && dt <= 0.0) return ContactEvent::none;
  last_imu_ns_ = sample.t_ns;
  if (first || dt > kLongestImuGap) return ContactEvent::none;

  const Eigen::Vector3d angle_B = dt * (sample.gyro_B - b_g_);
  ground_->turn(angle_B, sample.accel_B, dt);
  wheels_.pitch += angle_B.dot(axle_.T_BO.linear().col(1));
  if (mode_ != ContactMode::ground) ground_->move(kAirSpeed * dt);

  const double force = sample.accel_B.norm();
  if (force > kFreeFall)
    falling_since_ns_ = kNever;
  else if (falling_since_ns_ == kNever)
    falling_since_ns_ = sample.t_ns;
  if (std::abs(force - kGravity) > config_.strike) {
    strike_ns_ = sample.t_ns;
    ground_->strike();
  }
  return look_for_confirmed_touchdown(sample.t_ns);
}

ContactEvent ContactDetector::add_encoder(const EncoderSample& sample) {
  if (!ground_) return ContactEvent::none;
  const std::optional<EncoderSample> last = wheels_.last;
  const double pitch = wheels_.pitch;
  if (last && sample.t_ns <= last->t_ns) return ContactEvent::none;
  wheels_.last = sample;
  wheels_.pitch = 0.0;
  if (!last) return ContactEvent::none;
  const double dt = seconds_between(last->t_ns, sample.t_ns);
  const auto turned = [&](std::int64_t from, std::int64_t to) {
    std::int64_t n = to - from;
    if (axle_.wraps) {
      n %= axle_.resolution;
      if (2 * n >= axle_.resolution) n -= axle_.resolution;
      if (2 * n < -axle_.resolution) n += axle_.resolution;
    }
    return 2.0 * M_PI * static_cast<double>(n) / static_cast<double>(axle_.resolution);
  };
  const std::array<double, 2> angle{turned(last->left_count, sample.left_count),
                                    turned(last->right_count, sample.right_count)};
  const double follow = 1.0 - std::exp(-dt / kSpinUpTime);
  double distance = 0.0;
  for (std::size_t i = 0; i < 2; ++i) {
    distance = std::max(distance, std::abs(axle_.wheel_radius[i] * (angle[i] + pitch)));
    const double rate = angle[i] / dt;
    const double spin = (angle[i] + pitch) / dt;
    if (dt < kLongestEncoderGap && std::abs(rate) > std::abs(wheels_.slow_rate[i]) + kSpinUp &&
        std::abs(spin) > std::abs(wheels_.slow_spin[i]) + kSpinUp) {
      wheels_.spun_up_ns = sample.t_ns;
    }
    wheels_.slow_rate[i] += follow * (rate - wheels_.slow_rate[i]);
    wheels_.slow_spin[i] += follow * (spin - wheels_.slow_spin[i]);
  }
  roll(distance, dt);
  return look_for_confirmed_touchdown(sample.t_ns);
}

void ContactDetector::roll(double distance, double dt) {
  wheels_.recent_way = wheels_.recent_way * std::exp(-dt / kRecent) + distance;
  if (mode_ != ContactMode::ground) return;
  ground_->move(distance);
  ground_->suppose_height(level_, 0.02 / std::sqrt(distance / 0.02 + dt / 2.0));
  const double follow = 1.0 - std::exp(-distance / kLevelWay - dt / kLevelTime);
  level_ =
      std::clamp(level_ + follow * (ground_->height() - level_), -config_.touchdown_height, config_.touchdown_height);
}

double ContactDetector::tolerance(bool all_agree) const {
  const double doubt = all_agree ? std::min(1.0, wheels_.recent_way / kRecentWay) : 1.0;
  return config_.takeoff_height + config_.unevenness * doubt;
}

ContactEvent ContactDetector::add_laser(const LaserSample& sample) {
  if (!ground_) return ContactEvent::none;
  const GroundTracker::Sighting sighting = ground_->update(sample);
  if (sighting.agreeing > 0) seen_ns_ = sample.t_ns;
  switch (mode_) {
    case ContactMode::unknown:
      return look_for_first_evidence(sample.t_ns);
    case ContactMode::air:
      return look_for_touchdown(sample.t_ns);
    case ContactMode::ground:
      break;
  }
  const ContactEvent event = look_for_takeoff(sighting, sample.t_ns);
  return event;
}

ContactEvent ContactDetector::look_for_first_evidence(TimeNs t_ns) {
  if (!lasts(ground_->height_sigma() < kHeightKnown, t_ns, kFirstDuration)) return ContactEvent::none;
  return change(ground_->height() < config_.confirmed_height ? ContactMode::ground : ContactMode::air, t_ns);
}

ContactEvent ContactDetector::look_for_takeoff(const GroundTracker::Sighting& sighting, TimeNs t_ns) {
  const double allowed = level_ + tolerance(sighting.agreeing == ground_->beams());
  const bool seen = sighting.agreeing >= std::min(2, ground_->beams()) &&
                    ground_->height() - 2.0 * ground_->height_sigma() > allowed &&
                    sighting.lowest_lift > level_ + 0.5 * config_.takeoff_height;
  const bool falling = falling_since_ns_ != kNever && seconds_between(falling_since_ns_, t_ns) > kFallDuration;
  return lasts(seen, t_ns, falling ? 0.0 : config_.takeoff_duration) ? change(ContactMode::air, t_ns)
                                                                     : ContactEvent::none;
}

ContactEvent ContactDetector::look_for_touchdown(TimeNs t_ns) {
  const bool low = ground_->height_sigma() < config_.touchdown_height && ground_->height() < config_.touchdown_height &&
                   std::abs(ground_->climb()) < config_.touchdown_climb;
  return lasts(low, t_ns, config_.touchdown_duration) ? change(ContactMode::ground, t_ns)
                                                      : look_for_confirmed_touchdown(t_ns);
}

ContactEvent ContactDetector::look_for_confirmed_touchdown(TimeNs t_ns) {
  if (mode_ != ContactMode::air) return ContactEvent::none;
  const bool strike = seconds_between(strike_ns_, t_ns) < kConfirmation;
  const bool spin = seconds_between(wheels_.spun_up_ns, t_ns) < kConfirmation;
  const bool silent = seconds_between(seen_ns_, t_ns) > kSilence;
  const bool low = ground_->height_sigma() < kHeightKnown && ground_->height() < config_.confirmed_height;
  if (silent ? strike && spin : low && (strike || spin)) return change(ContactMode::ground, t_ns);
  return ContactEvent::none;
}

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
    wheels_.recent_way = kRecentWay;  // on new ground
  }
  if (first) return ContactEvent::none;
  return mode == ContactMode::ground ? ContactEvent::touchdown : ContactEvent::takeoff;
}

}  // namespace ear
