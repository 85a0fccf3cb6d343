#include "filter/sources/clock_excess.h"

#include <Eigen/Cholesky>
#include <cmath>

#include "filter/ingest/limits.h"
#include "filter/sources/cameras/stereo_motion.h"

namespace ear {

/// The angular acceleration in the middle of two frames is by what the rate changes from those before to those after:
/// so each is counted when the next comes.
void ClockExcess::add(const SeenTurn& turn) {
  const double dt = last_.t_ns ? seconds_between(last_.t_ns, turn.t_ns) : INFINITY;
  if (!(dt > 0.0 && dt < kStreamMemory)) *this = ClockExcess{};
  const bool next = follows(dt, turn.duration);
  in_a_row_ = next ? in_a_row_ + 1 : 0;
  if (in_a_row_ > 1 && turn.rate_B.allFinite() && last_.beyond_B.allFinite() && last_.variance > 0.0) {
    const double between = last_.duration + 0.5 * (turn.duration + before_.duration);
    const Eigen::Vector3d accel = (turn.rate_B - before_.rate_B) / between;
    const Vector4 usual(1.0, last_.rate_B.x(), last_.rate_B.y(), last_.rate_B.z());
    const double exactness = 1.0 / last_.variance;
    const double kept = std::exp(-dt / kStreamMemory);
    const auto add_to = [kept](auto& sum, const auto& value) { sum = kept * sum + value; };
    add_to(sums_.weight, 1.0);
    add_to(sums_.usual, exactness * usual * usual.transpose());
    add_to(sums_.accel_usual, exactness * accel * usual.transpose());
    add_to(sums_.beyond_usual, exactness * last_.beyond_B * usual.transpose());
    add_to(sums_.accel_accel, exactness * accel.squaredNorm());
    add_to(sums_.accel_beyond, exactness * accel.dot(last_.beyond_B));
    add_to(sums_.beyond_beyond, exactness * last_.beyond_B.squaredNorm());
    span_ += dt;
  }
  before_ = last_;
  last_ = turn;
}

/// Least squares. A bias of the gyroscope is a constant; its scales and axes, where the cameras point and their focal
/// length are as the rate.
std::optional<ClockExcess::Offset> ClockExcess::offset() const {
  const Sums& s = sums_;
  const double freedom = 3.0 * s.weight - 13.0;  // three axes, less the unknowns
  if (span_ < kStreamMemory || freedom < kToKnow) return std::nullopt;
  const Eigen::LDLT<Eigen::Matrix4d> usual(s.usual);
  const Matrix34 gain = usual.solve(s.accel_usual.transpose()).transpose();
  const double accel = s.accel_accel - gain.cwiseProduct(s.accel_usual).sum();
  const double product = s.accel_beyond - gain.cwiseProduct(s.beyond_usual).sum();
  const Matrix34 explained = usual.solve(s.beyond_usual.transpose()).transpose();
  const double beyond = s.beyond_beyond - explained.cwiseProduct(s.beyond_usual).sum();
  Offset offset;
  offset.value = product / accel;
  offset.variance = (beyond - offset.value * product) / (freedom * accel);
  if (!(accel > 0.0) || !std::isfinite(offset.value) || !(offset.variance > 0.0)) return std::nullopt;
  return offset;
}

/// What is more than a reading may be late has another cause.
double ClockExcess::take(double known) {
  const std::optional<Offset> found = offset();
  if (!found || !(found->value * found->value > kClear * kClear * (found->variance + known))) return 0.0;
  *this = ClockExcess{};
  const double off = std::abs(found->value);
  return off < kSilent ? off : 0.0;
}

}  // namespace ear
