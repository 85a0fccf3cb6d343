#include "filter/sources/wheels/mounting_watch.h"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>

#include "filter/ekf/state.h"
#include "filter/ingest/evidence.h"
#include "filter/ingest/silence.h"
#include "filter/ingest/stream_clock.h"

namespace ear {

MountingWatch::Gained& MountingWatch::Gained::add(const Gained& other, double weight) {
  inertial += weight * other.inertial;
  for (std::size_t i = 0; i < 2; ++i) {
    wheels[i] += weight * other.wheels[i];
    rates[i] += weight * other.rates[i];
  }
  return *this;
}

MountingWatch::MountingWatch(const OdometerConfig& config, const EncoderCalibration& encoder)
    : config_(config),
      radius_(0.5 * (encoder.wheel_radius[0] + encoder.wheel_radius[1])),
      track_width_(encoder.track_width),
      R_OB_(encoder.T_BO.linear().transpose()),
      p_OB_(-R_OB_ * encoder.T_BO.translation()) {}

void MountingWatch::restart(TimeNs t_ns, const Eigen::Vector3d& up_B) {
  end_ns_ = t_ns;
  up_O_ = R_OB_ * up_B;
  duration_ = 0.0;
  gained_ = sum_ = Gained{};
  windows_ = 0;
}

void MountingWatch::add(const WheelIncrement& increment, const ImuBuffer& imu, const Eigen::Vector3d& b_g,
                        const Eigen::Vector3d& up_B) {
  if (increment.duration() <= 0.0) return;
  const bool gap = increment.from_ns != end_ns_ || increment.duration() > kStreamGap;
  if (gap || windows_ >= kToKnow) restart(increment.from_ns, up_B);
  end_ns_ = increment.to_ns;
  const double dt = increment.duration();
  Eigen::Vector3d turn = Eigen::Vector3d::Zero(), force = Eigen::Vector3d::Zero();
  imu.for_each_piece(increment.from_ns, increment.to_ns,
                     [&](const Eigen::Vector3d& gyro_B, const Eigen::Vector3d& accel_B, double piece) {
                       const Eigen::Vector3d rate = R_OB_ * (gyro_B - b_g);
                       turn += piece * rate;
                       up_O_ += piece * up_O_.cross(rate);
                       force += piece * (R_OB_ * accel_B + kGravity_W.z() * up_O_);
                     });
  const double pitch = config_.model == OdometerModel::terrain ? turn.y() : 0.0;  // (5)
  const double speed = radius_ * (increment.angle.mean() + pitch) / dt;
  Gained change;
  change.inertial = {force.x(), force.y()};
  change.wheels[1] = turn.z() * speed;
  const Eigen::Vector3d lever = (turn / dt).cross(p_OB_);
  Gained now = gained_;  // in the middle
  now.add(change, 0.5);
  now.inertial -= std::complex<double>(lever.x(), lever.y());
  now.wheels[0] = speed;
  now.rates = {radius_ * (increment.angle(1) - increment.angle(0)) / track_width_ / dt, turn.z() / dt};
  gained_.add(change, 1.0);
  sum_.add(now, dt);
  duration_ += dt;
  if (duration_ >= 2.0 * kStreamGap) close_window();
}

/// How the mean velocity changed from window to window, less how it changed before: a tilt that stays drops out.
void MountingWatch::close_window() {
  Gained mean;
  mean.add(sum_, 1.0 / duration_);
  Gained change = mean;
  change.add(means_[1], -2.0).add(means_[0], 1.0);
  const double kept = std::exp(-duration_ / kSlopeMemory);
  if (windows_ >= 2 && std::hypot(change.wheels[0], change.wheels[1]) > config_.speed_sigma) {
    const Eigen::Vector2cd x(change.wheels[0], std::complex<double>(0.0, change.wheels[1]));
    Regression& r = regression_;
    r.xx = kept * r.xx + x.conjugate() * x.transpose();
    r.xy = kept * r.xy + x.conjugate() * change.inertial;
    r.yy = kept * r.yy + std::norm(change.inertial);
    r.count = kept * r.count + 1.0;
  }
  if (windows_ >= 2) {
    const double w = change.rates[0], g = change.rates[1];
    Turns& t = turns_;
    t = {kept * t.gg + g * g, kept * t.gw + g * w, kept * t.ww + w * w, kept * t.count + 1.0};
  }
  means_ = {means_[1], mean};
  ++windows_;
  sum_ = Gained{};
  duration_ = 0.0;
  contradicts_ = forwards_apart() || turns_apart();
}

/// Slopes are 1 where all is well, and less where wheels slip, but never backwards. Half of it or more to a side: axes
/// are exchanged.
bool MountingWatch::forwards_apart() const {
  const Regression& r = regression_;
  if (r.count < kToKnow) return false;
  // What never changed is not known: its slope has the standard deviation that so little gives.
  const double least = config_.speed_sigma * config_.speed_sigma;
  const Eigen::Matrix2cd inverse = (r.xx + least * Eigen::Matrix2cd::Identity()).inverse();
  const Eigen::Vector2cd slopes = inverse * r.xy;
  const double variance = std::max(0.0, r.yy - r.xy.dot(slopes).real()) / (2.0 * (r.count - 2.0));
  for (Eigen::Index i = 0; i < 2; ++i) {
    const std::complex<double> slope = slopes(i);
    const double doubt = kClear * std::sqrt(variance * inverse(i, i).real());
    if (slope.real() + doubt < 0.0 || std::abs(slope.imag()) - doubt > std::max(0.5, slope.real())) return true;
  }
  return false;
}

/// The slope of the wheels' turns on the gyroscope's: wheels that scrub turn more, never against it. Radii and bias
/// that are a little wrong make a turn in every window, of the size that the yaw rate's noise has.
bool MountingWatch::turns_apart() const {
  const Turns& t = turns_;
  if (t.count < kToKnow || t.gg <= 0.0) return false;
  const double slope = t.gw / t.gg;
  const double sigma = std::sqrt(std::max(0.0, t.ww - slope * t.gw) / (t.count - 1.0) / t.gg);
  const double noise = config_.yaw_rate_sigma * std::sqrt(t.count / t.gg);  // at worst, always the same way
  return slope + kClear * sigma + noise < 0.0;
}

}  // namespace ear
