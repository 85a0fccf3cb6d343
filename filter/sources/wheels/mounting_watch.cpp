#include "filter/sources/wheels/mounting_watch.h"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <complex>

#include "filter/ekf/state.h"
#include "filter/ingest/limits.h"
#include "filter/ingest/stream_clock.h"

namespace ear {

void MountingWatch::Products::add(const Motion& change, double kept) {
  sum = kept * sum + change * change.transpose();
  count = kept * count + 1.0;
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
  gained_ = sum_ = Motion::Zero();
  windows_ = 0;
}

void MountingWatch::add(const WheelIncrement& increment, const ImuBuffer& imu, const Eigen::Vector3d& b_g,
                        const Eigen::Vector3d& up_B) {
  if (increment.duration() <= 0.0) return;
  const bool gap = increment.from_ns != end_ns_ || increment.duration() > kStale;
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
  const Eigen::Vector3d lever = (turn / dt).cross(p_OB_);
  Motion change = Motion::Zero();
  change.head<2>() = force.head<2>();
  change(wheels_left) = turn.z() * speed;
  Motion now = gained_ + 0.5 * change;  // in the middle
  now.head<2>() -= lever.head<2>();
  now(wheels_ahead) = speed;
  now(wheels_turn) = radius_ * (increment.angle(1) - increment.angle(0)) / track_width_ / dt;
  now(gyro_turn) = turn.z() / dt;
  gained_ += change;
  sum_ += dt * now;
  duration_ += dt;
  if (duration_ >= 2.0 * kStreamGap) close_window();
}

/// How the mean velocity changed from window to window, less how it changed before: a tilt that stays drops out.
void MountingWatch::close_window() {
  const Motion mean = sum_ / duration_;
  const Motion change = mean - 2.0 * means_[1] + means_[0];
  const double kept = std::exp(-duration_ / kSlopeMemory);
  if (windows_ >= 2) {
    turned_.add(change, kept);
    if (std::hypot(change(wheels_ahead), change(wheels_left)) > config_.speed_sigma) moved_.add(change, kept);
  }
  means_ = {means_[1], mean};
  ++windows_;
  sum_.setZero();
  duration_ = 0.0;
  contradicts_ = forwards_apart() || turns_apart();
}

/// Slopes are 1 where all is well, and less where wheels slip, but never backwards, ahead or to the left. Axes that are
/// turned turn both alike: half of it or more to a side, and they are exchanged.
bool MountingWatch::forwards_apart() const {
  if (moved_.count < kToKnow) return false;
  // A velocity is ahead + i left: least squares over the slopes of the inertial one on the wheels' two parts, and on
  // both together. What never changed is not known: its slope has the standard deviation that so little gives.
  Eigen::Matrix<std::complex<double>, 6, 3> parts = Eigen::Matrix<std::complex<double>, 6, 3>::Zero();
  parts(wheels_ahead, 0) = parts(inertial_ahead, 2) = 1.0;
  parts(wheels_left, 1) = parts(inertial_left, 2) = {0.0, 1.0};
  const Eigen::Matrix3cd products = parts.adjoint() * moved_.sum * parts;
  const double least = config_.speed_sigma * config_.speed_sigma;
  const Eigen::Matrix2cd wheels = products.topLeftCorner<2, 2>() + least * Eigen::Matrix2cd::Identity();
  const Eigen::Vector2cd xy = products.topRightCorner<2, 1>();
  const double yy = products(2, 2).real();
  const auto doubt = [&](double left_over, double fitted, double inverse) {
    return kClear * std::sqrt(std::max(0.0, left_over) / (2.0 * (moved_.count - fitted)) * inverse);
  };
  const Eigen::Matrix2cd inverse = wheels.inverse();
  const Eigen::Vector2cd slopes = inverse * xy;
  const double left_over = yy - xy.dot(slopes).real();
  for (Eigen::Index i = 0; i < 2; ++i) {
    if (slopes(i).real() + doubt(left_over, 2.0, inverse(i, i).real()) < 0.0) return true;
  }
  const double both = wheels.sum().real();
  const std::complex<double> slope = xy.sum() / both;
  const double aside = std::abs(slope.imag()) - doubt(yy - std::norm(slope) * both, 1.0, 1.0 / both);
  return aside > std::max(0.5, slope.real());
}

/// The slope of the wheels' turns on the gyroscope's: wheels that scrub turn more, never against it. Radii and bias
/// that are a little wrong make a turn in every window, of the size that the yaw rate's noise has.
bool MountingWatch::turns_apart() const {
  const double gg = turned_.sum(gyro_turn, gyro_turn), gw = turned_.sum(gyro_turn, wheels_turn);
  const double ww = turned_.sum(wheels_turn, wheels_turn);
  if (turned_.count < kToKnow || gg <= 0.0) return false;
  const double slope = gw / gg;
  const double sigma = std::sqrt(std::max(0.0, ww - slope * gw) / (turned_.count - 1.0) / gg);
  const double noise = config_.yaw_rate_sigma * std::sqrt(turned_.count / gg);  // at worst, always the same way
  return slope + kClear * sigma + noise < 0.0;
}

}  // namespace ear
