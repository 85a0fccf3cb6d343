#include "filter/sources/gyro_excess.h"

#include <cmath>
#include <utility>

#include "filter/sources/cameras/stereo_motion.h"

namespace ear {

/// The bias walks by as much as makes it follow within kStale, and not while nothing is seen: one frame would be enough
/// then. A calibration may be wrong by four times what it says. What the state has learned meanwhile is no longer
/// beyond it.
void GyroExcess::add(const Frame& frame, const Covariance& P) {
  const SeenTurn& turn = frame.turn;
  const double b_g_variance = P.matrix().diagonal().segment<3>(err::b_g).maxCoeff();
  const bool finite = turn.rate_B.allFinite() && turn.beyond_B.allFinite() && frame.b_g.allFinite();
  if (!finite || !(turn.variance > 0.0) || !(b_g_variance >= 0.0)) return;
  const double dt = last_.turn.t_ns ? seconds_between(last_.turn.t_ns, turn.t_ns) : INFINITY;
  const double variance = turn.variance / std::pow(unexplained_.weight(), 2);
  if (!(dt > 0.0 && dt < kLostAfter)) {
    *this = GyroExcess{};
    const double by_rate = apparent_turn_variance(P, Eigen::Vector3d::UnitX(), Eigen::Vector3d::Zero());
    Vector7 prior;
    prior << b_g_variance, Eigen::Vector3d::Constant(kClear * kClear * by_rate),
        Eigen::Vector3d::Constant(kSilent * kSilent);
    P_ = prior.asDiagonal();
  } else {
    x_.row(0) += (frame.b_g - last_.b_g).transpose();
    x_.bottomRows<3>().diagonal().array() -= frame.time_offset - last_.time_offset;
    P_(0, 0) += variance * std::pow(turn.duration / kStale, 2);
  }
  if (follows(dt, turn.duration)) {
    Vector7 H;
    H << 1.0, turn.rate_B, (turn.rate_B - last_.turn.rate_B) / dt;
    const Vector7 PH = P_ * H;
    const double known = H.dot(PH);
    const Vector7 gain = PH / (known + variance);
    const Eigen::RowVector3d innovation = turn.beyond_B.transpose() - H.transpose() * x_;
    for (int axis = 0; axis < 3; ++axis) unexplained_.add(innovation(axis), {known, turn.variance}, turn.t_ns);
    x_ += gain * innovation;
    P_ -= gain * PH.transpose();
    lasting_ += (1.0 - std::exp(-dt / kStale)) * (frame.lasting - lasting_);
  }
  last_ = frame;
  asked_ = false;
}

double GyroExcess::take(const Covariance& P) {
  if (std::exchange(asked_, true)) return 0.0;
  const Bias off = bias();
  const Eigen::Array3d variance = off.variance + P.matrix().diagonal().segment<3>(err::b_g).array();
  int worst = 0;
  const bool clear = (off.value.array().square() / variance).maxCoeff(&worst) > kClear * kClear;
  return clear ? std::abs(off.value(worst)) : 0.0;
}

}  // namespace ear
