#include "filter/sources/ground/ground_tracker.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

#include "filter/ekf/so3.h"
#include "filter/ingest/silence.h"

namespace ear {
namespace {

constexpr double kUnevenness = 0.004;    // [m] chosen: of the ground under a beam against the plane
constexpr double kNormalWalk = 0.1;      // [rad/sqrt(m)] chosen: how the normal changes with the distance
constexpr double kSlope = 0.2;           // [rad] chosen: standard deviation of the ground's slopes
constexpr double kNoChance = 0.07;       // [s] chosen: readings that are equal, or that agree again, for so long,
constexpr int kFewestEqual = 4;          // chosen: and so many; noise makes two equal ones a chance of some percent
constexpr double kSteepest = 0.8;        // [rad] chosen: ground that is tilted more is none
constexpr double kUpTime = 3.0;          // [s] chosen: over which the specific force is against gravity in the mean
constexpr double kNormalDrift = 0.02;    // [rad/sqrt(s)] chosen: what is left of the gyroscope's errors
constexpr double kClimbWalk = 0.3;       // [m/s/sqrt(s)] chosen
constexpr double kUnknownNormal = 0.25;  // [rad] chosen: of the body's tilt against the ground
constexpr double kUnknownHeight = 4.0;   // [m] chosen
constexpr double kUnknownClimb = 1.0;    // [m/s] chosen: at first, and what a strike changes
constexpr double kGate = 4.0;            // chosen: standard deviations
constexpr double kReturnGate = 2.0;      // chosen: the same for a beam that disagreed before
constexpr double kLostTime = 0.03;       // [s] chosen: readings without any agreement, until all is forgotten

}  // namespace

GroundTracker::GroundTracker(const LaserCalibration& lasers, const EncoderCalibration& axle)
    : lasers_(lasers),
      p_BO_(axle.T_BO.translation()),
      radius_(0.5 * (axle.wheel_radius[0] + axle.wheel_radius[1])),
      beams_(lasers.beams.size()) {
  x_.head<3>() = axle.T_BO.linear().col(2);
  forget();
}

double GroundTracker::height_sigma() const { return std::sqrt(P_(kHeight, kHeight)); }

void GroundTracker::turn(const Eigen::Vector3d& angle_B, const Eigen::Vector3d& accel_B, double dt) {
  const Eigen::Matrix3d R = exp_so3(-angle_B);
  x_.head<3>() = R * x_.head<3>();
  P_.topRows<3>() = R * P_.topRows<3>();
  P_.leftCols<3>() = P_.leftCols<3>() * R.transpose();
  widen_normal(kNormalDrift * kNormalDrift * dt);

  const Eigen::Vector3d force_B = accel_B.normalized();
  up_B_ = up_B_.isZero() ? force_B : Eigen::Vector3d(R * up_B_ + dt / kUpTime * (force_B - up_B_)).normalized();
}

/// The normal walks; but the ground is level by and large. A walk that is pulled back with sigma^2 = slope^4 / walk^2
/// for every metre settles at a standard deviation of `slope`.
void GroundTracker::move(double distance) {
  if (!(distance > 0.0) || up_B_.isZero()) return;
  widen_normal(kNormalWalk * kNormalWalk * distance);
  const double variance = std::pow(kSlope, 4) / (kNormalWalk * kNormalWalk * distance);
  for (int axis = 0; axis < 3; ++axis) update(Vector::Unit(axis), up_B_(axis) - x_(axis), variance);
}

void GroundTracker::strike() { P_(kClimb, kClimb) += kUnknownClimb * kUnknownClimb; }

void GroundTracker::suppose_height(double level, double sigma) {
  const Vector H = Vector::Unit(kHeight);
  if (passes(H, level - height(), sigma * sigma, kReturnGate)) update(H, level - height(), sigma * sigma);
}

GroundTracker::Sighting GroundTracker::update(const LaserSample& sample) {
  const double dt = any_ ? seconds_between(last_ns_, sample.t_ns) : 0.0;
  any_ = true;
  last_ns_ = sample.t_ns;
  if (dt > kStale) forget();
  predict(dt);

  Sighting sighting;
  const Eigen::Vector3d before_B = n_B();
  const std::size_t count = std::min(lasers_.beams.size(), sample.range.size());
  for (std::size_t i = 0; i < count; ++i) {
    if (!usable(beams_[i], sample.range[i], sample.t_ns)) continue;
    ++sighting.readings;
    const Eigen::Vector3d hit_B = lasers_.beams[i].p_BL + sample.range[i] * lasers_.beams[i].d_B - p_BO_;
    if (!update_with_hit(beams_[i], lasers_.beams[i].d_B, hit_B, sample.t_ns)) continue;
    const double lift = -before_B.dot(hit_B) - radius_;
    sighting.lowest_lift = sighting.agreeing == 0 ? lift : std::min(sighting.lowest_lift, lift);
    ++sighting.agreeing;
  }
  if (sighting.agreeing > 0) lost_from_ns_.reset();
  if (sighting.agreeing == 0 && sighting.readings >= 2 && !lost_from_ns_) lost_from_ns_ = sample.t_ns;
  const bool lost = lost_from_ns_ && sighting.readings >= 2 && seconds_between(*lost_from_ns_, sample.t_ns) > kLostTime;
  if (lost || (!up_B_.isZero() && n_B().dot(up_B_) < std::cos(kSteepest))) forget();
  return sighting;
}

/// A return that is not always the same: noise makes each reading of a working beam another one.
bool GroundTracker::usable(Beam& beam, double range, TimeNs t_ns) const {
  if (range != beam.last) {
    beam.same = 0;
    beam.same_from_ns = t_ns;
  }
  beam.last = range;
  beam.stuck = ++beam.same >= kFewestEqual && seconds_between(beam.same_from_ns, t_ns) > kNoChance;
  return !beam.stuck && range >= lasers_.range_min && range <= lasers_.range_max;
}

std::bitset<kMaxBeams> GroundTracker::stuck_beams() const {
  std::bitset<kMaxBeams> stuck;
  for (std::size_t i = 0; i < beams_.size(); ++i) stuck[i] = beams_[i].stuck;
  return stuck;
}

/// 0 = n_B . hit + r + h, linear in the state. False if the beam is not used.
bool GroundTracker::update_with_hit(Beam& beam, const Eigen::Vector3d& d_B, const Eigen::Vector3d& hit_B, TimeNs t_ns) {
  Vector H = Vector::Unit(kHeight);
  H.head<3>() = hit_B;
  const double residual = -(n_B().dot(hit_B) + radius_ + height());
  const double noise = n_B().dot(d_B) * lasers_.noise;
  const double variance = noise * noise + kUnevenness * kUnevenness;
  if (!passes(H, residual, variance, beam.returning ? kReturnGate : kGate)) {
    beam.returning = true;
    beam.agrees_from_ns.reset();
    return false;
  }
  if (beam.returning) {
    if (!beam.agrees_from_ns) beam.agrees_from_ns = t_ns;
    if (seconds_between(*beam.agrees_from_ns, t_ns) < kNoChance) return false;
    beam.returning = false;
  }
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
  widen_normal(kUnknownNormal * kUnknownNormal);
  P_(kHeight, kHeight) = kUnknownHeight * kUnknownHeight;
  P_(kClimb, kClimb) = kUnknownClimb * kUnknownClimb;
  x_(kClimb) = 0.0;
  for (Beam& beam : beams_) beam.returning = false;
  lost_from_ns_.reset();
}

}  // namespace ear
