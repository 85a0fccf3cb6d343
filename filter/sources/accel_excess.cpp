#include "filter/sources/accel_excess.h"

#include <cmath>

#include "filter/ingest/limits.h"
#include "filter/sources/cameras/stereo_motion.h"

namespace ear {

void AccelExcess::Sums::age(double dt, double kept) {
  squares = kept * (squares - 2.0 * dt * times + dt * dt * ones);
  times = kept * (times - dt * ones);
  ones *= kept;
}

/// Updates correct the velocity, and what was seen before them would be beyond it by that much more: it is counted from
/// the samples alone. So the line ends where the samples between two frames are not known.
void AccelExcess::add(const Frame& frame, const Covariance& P) {
  const double dt = last_.t_ns ? seconds_between(last_.t_ns, frame.t_ns) : INFINITY;
  const bool next = follows(dt, frame.duration);
  if (!next) *this = AccelExcess{};
  if (!frame.beyond_W.allFinite() || !frame.v_W.allFinite() || !frame.gained_W.allFinite()) return;
  const Eigen::Vector3d accel_W = frame.gained_W / frame.duration;
  Eigen::Vector3d jerk_W = Eigen::Vector3d::Zero();
  if (next) {
    const double kept = std::exp(-dt / kStale);
    weights_.age(dt, kept);
    values_.age(dt, kept);
    variances_.age(dt, kept * kept);
    gains_.age(dt, kept * kept);
    apparent_ *= kept;
    span_ += dt;
    corrected_W_ += frame.v_W - (last_.v_W + last_.gained_W);
    jerk_W = (accel_W - last_.gained_W / last_.duration) / dt;
  }
  weights_.ones.array() += 1.0;
  values_.ones += frame.beyond_W + corrected_W_;
  variances_.ones += frame.beyond_variance;
  gains_.ones += frame.gained_variance;
  apparent_ += apparent_variance(P, accel_W, jerk_W) + accel_W.squaredNorm() * kPrecise * kPrecise;  // and of depths
  last_ = frame;
}

std::optional<AccelExcess::Growth> AccelExcess::growth(const Covariance& P) const {
  const Eigen::Array3d s0 = weights_.ones, s1 = weights_.times;
  const Eigen::Array3d determinant = s0 * weights_.squares.array() - s1 * s1;
  if (span_ < kStale || !(determinant.minCoeff() > 0.0)) return std::nullopt;
  Growth growth;
  growth.value = (s0 * values_.times.array() - s1 * values_.ones.array()) / determinant;
  const Eigen::Array3d noise = (s0 * s0 * variances_.squares.array() - 2.0 * s0 * s1 * variances_.times.array() +
                                s1 * s1 * variances_.ones.array()) /
                               (determinant * determinant);
  const double tilt = P.matrix().diagonal().segment<2>(err::theta).maxCoeff();
  const double bias = P.matrix().diagonal().segment<3>(err::b_a).maxCoeff();
  const Eigen::Array3d gravity = kGravity_W.squaredNorm() * tilt * Eigen::Array3d(1.0, 1.0, 0.0);
  // An error of the gained velocity lasts. One t before now turns the line by t / kStale^2 exp(t / kStale).
  const Eigen::Array3d gained = gains_.squares / std::pow(kStale, 4);
  growth.variance = noise + gained + apparent_ / s0 + gravity + bias;
  if (!growth.value.allFinite() || !(growth.variance.minCoeff() > 0.0)) return std::nullopt;
  return growth;
}

double AccelExcess::take(const Covariance& P) {
  const std::optional<Growth> found = growth(P);
  int worst = 0;
  if (!found || (found->value.square() / found->variance).maxCoeff(&worst) <= kClear * kClear) return 0.0;
  *this = AccelExcess{};
  return std::abs(found->value(worst));
}

}  // namespace ear
