#include "filter/sources/ground/ground_tracker.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

#include "filter/ekf/so3.h"
#include "filter/ingest/limits.h"

namespace ear {
namespace {

constexpr double kUnevenness = 0.004;  // [m] chosen: of the ground under a beam against the plane
constexpr double kClimbWalk = 0.3;     // [m/s/sqrt(s)] chosen
constexpr double kReturnGate = 2.0;    // chosen: standard deviations, of a beam that disagreed before; else kClear
constexpr double kSteepest = 0.8;      // [rad] chosen: ground that is tilted more is none
constexpr double kUpTime = 3.0;        // [s] chosen: over which the specific force is against gravity in the mean

}  // namespace

GroundTracker::GroundTracker(const LaserCalibration& lasers, const EncoderCalibration& axle,
                             const OdometerConfig& config)
    : lasers_(lasers),
      p_BO_(axle.T_BO.translation()),
      radius_(0.5 * (axle.wheel_radius[0] + axle.wheel_radius[1])),
      normal_walk_(config.normal_walk),
      beams_(lasers.beams.size()) {
  x_.head<3>() = axle.T_BO.linear().col(2);
  forget();
}

double GroundTracker::height_sigma() const { return std::sqrt(P_(kHeight, kHeight)); }

double GroundTracker::climb_sigma() const { return std::sqrt(P_(kClimb, kClimb)); }

void GroundTracker::turn(const Eigen::Vector3d& angle_B, const Eigen::Vector3d& accel_B, double dt) {
  const Eigen::Matrix3d R = exp_so3(-angle_B);
  x_.head<3>() = R * x_.head<3>();
  P_.topRows<3>() = R * P_.topRows<3>();
  P_.leftCols<3>() = P_.leftCols<3>() * R.transpose();

  const Eigen::Vector3d force_B = accel_B.normalized();
  up_B_ = up_B_.isZero() ? force_B : Eigen::Vector3d(R * up_B_ + dt / kUpTime * (force_B - up_B_)).normalized();
}

/// The normal walks; but the ground is level by and large. A walk that is pulled back with sigma^2 = slope^4 / walk^2
/// for every metre settles at a standard deviation of `slope`.
void GroundTracker::move(double distance) {
  if (!(distance > 0.0) || up_B_.isZero()) return;
  widen_normal(normal_walk_ * normal_walk_ * distance);
  const double variance = std::pow(kSlope, 4) / (normal_walk_ * normal_walk_ * distance);
  for (int axis = 0; axis < 3; ++axis) update(Vector::Unit(axis), up_B_(axis) - x_(axis), variance);
}

void GroundTracker::strike() { P_(kClimb, kClimb) += kFlightSpeed * kFlightSpeed; }

void GroundTracker::suppose_height(double level, double sigma) {
  const Vector H = Vector::Unit(kHeight);
  if (passes(H, level - height(), sigma * sigma, kReturnGate)) update(H, level - height(), sigma * sigma);
}

int GroundTracker::update(const LaserSample& sample) {
  const double dt = last_ns_ ? seconds_between(*last_ns_, sample.t_ns) : 0.0;
  last_ns_ = sample.t_ns;
  if (dt < 0.0 || dt > kStale) forget();
  predict(std::max(0.0, dt));

  int readings = 0, agreeing = 0;  // beams with a return
  const std::size_t count = std::min(lasers_.beams.size(), sample.range.size());
  for (std::size_t i = 0; i < count; ++i) {
    if (!usable(beams_[i], sample.range[i])) continue;
    ++readings;
    beams_[i].usable_ns = sample.t_ns;
    const Eigen::Vector3d hit_B = lasers_.beams[i].p_BL + sample.range[i] * lasers_.beams[i].d_B - p_BO_;
    if (update_with_hit(beams_[i], lasers_.beams[i].d_B, hit_B)) ++agreeing;
  }
  if (agreeing > 0) lost_ = 0;
  if (agreeing == 0 && readings >= 2) ++lost_;
  if (lost_ >= kConfirmed || (!up_B_.isZero() && n_B().dot(up_B_) < std::cos(kSteepest))) forget();
  return agreeing;
}

/// A return that is not always the same.
bool GroundTracker::usable(Beam& beam, double range) const {
  beam.repeats.add(range);
  return !beam.repeats.stuck() && is_return(range, lasers_);
}

std::bitset<kMaxBeams> GroundTracker::beams_that(BeamRepeats::Property property) const {
  std::bitset<kMaxBeams> which;
  for (std::size_t i = 0; i < beams_.size(); ++i) which[i] = (beams_[i].repeats.*property)();
  return which;
}

int GroundTracker::beams_that_see() const {
  const auto sees = [this](const Beam& beam) {
    return beam.usable_ns && seconds_between(*beam.usable_ns, *last_ns_) < kStreamGap;
  };
  return static_cast<int>(std::count_if(beams_.begin(), beams_.end(), sees));
}

/// 0 = n_B . hit + r + h, linear in the state. False if the beam is not used.
bool GroundTracker::update_with_hit(Beam& beam, const Eigen::Vector3d& d_B, const Eigen::Vector3d& hit_B) {
  Vector H = Vector::Unit(kHeight);
  H.head<3>() = hit_B;
  const double residual = -(n_B().dot(hit_B) + radius_ + height());
  const double noise = n_B().dot(d_B) * lasers_.noise;
  const double variance = noise * noise + kUnevenness * kUnevenness;
  beam.agrees = passes(H, residual, variance, beam.agrees < kNoChance ? kReturnGate : kClear)
                    ? std::min(beam.agrees + 1, kNoChance)
                    : 0;
  if (beam.agrees < kNoChance) return false;
  update(H, residual, variance);
  return true;
}

bool GroundTracker::passes(const Vector& H, double residual, double variance, double gate) const {
  return residual * residual < gate * gate * (H.dot(P_ * H) + variance);
}

void GroundTracker::update(const Vector& H, double residual, double variance) {
  const Vector PH = P_ * H;
  const Vector gain = PH / (H.dot(PH) + variance);
  x_ += residual * gain;
  P_ -= gain * PH.transpose();
  // Still a unit vector, with no variance along itself.
  x_.head<3>().normalize();
  const Eigen::Matrix3d tangent = Eigen::Matrix3d::Identity() - n_B() * n_B().transpose();
  P_.topRows<3>() = tangent * P_.topRows<3>();
  P_.leftCols<3>() = P_.leftCols<3>() * tangent;
  P_ = 0.5 * (P_ + P_.transpose()).eval();
}

void GroundTracker::predict(double dt) {
  x_(kHeight) += dt * x_(kClimb);
  P_.row(kHeight) += dt * P_.row(kClimb);
  P_.col(kHeight) += dt * P_.col(kClimb);
  P_(kClimb, kClimb) += kClimbWalk * kClimbWalk * dt;
}

void GroundTracker::widen_normal(double variance) {
  P_.topLeftCorner<3, 3>() += variance * (Eigen::Matrix3d::Identity() - n_B() * n_B().transpose());
}

/// Nothing is known but roughly where up is.
void GroundTracker::forget() {
  P_.setZero();
  if (!up_B_.isZero()) x_.head<3>() = up_B_;
  widen_normal(kSlope * kSlope);
  P_(kHeight, kHeight) = lasers_.range_max * lasers_.range_max;
  P_(kClimb, kClimb) = kFlightSpeed * kFlightSpeed;
  x_(kClimb) = 0.0;
  for (Beam& beam : beams_) beam.agrees = kNoChance;
  lost_ = 0;
}

}  // namespace ear
