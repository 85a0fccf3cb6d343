#include "filter/health/bias_watch.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>

#include "ear/filter_config.h"
#include "filter/ingest/limits.h"

namespace ear {
namespace {

using Vector6 = BiasChanges::Vector6;
using Matrix6 = BiasChanges::Matrix6;

constexpr double kGyroFault = 5e-3;  // [rad/s] measured: on sound sensors of public recordings up to 2.2e-3
constexpr double kAccelFault = 0.1;  // [m/s^2] measured: the same, up to 0.036

/// A jump d corrects the biases by L P^-1 d in the mean, with covariance L, where updates lower P by L. Of the d that
/// fits best, and all that fit nearly as well: the root mean square. Before, it may be ten times what biases are.
Vector6 jump_size(const BiasChanges& sum, const Matrix6& P) {
  const PriorConfig usual;
  const Vector6 information = bias_sigma(usual.gyro_bias, usual.accel_bias).cwiseAbs2().cwiseInverse() / kFarthest;
  const Eigen::LDLT<Matrix6> M(sum.lowered + P * information.asDiagonal() * P);
  const Vector6 d = P * M.solve(sum.correction);
  const Matrix6 covariance = P * M.solve(P);
  return (d.cwiseAbs2() + covariance.diagonal().cwiseMax(0.0)).cwiseSqrt();
}

}  // namespace

BiasJump BiasWatch::judge(const BiasChanges& changes, TimeNs t_ns) {
  if (changes.restarted) {
    sum_ = BiasChanges{};
    moved_.setZero();
  }
  sum_.add(changes.correction, changes.lowered);
  moved_ += changes.correction;
  BiasJump jump;
  const Vector6 allowed = kClear * sum_.lowered.diagonal().cwiseMax(0.0).cwiseSqrt();
  if ((sum_.correction.array().abs() > allowed.array()).any()) {
    const Matrix6 P = changes.left + sum_.lowered;
    jump.size = jump_size(sum_, P);
    const bool recently = jumped_ns_ && seconds_between(*jumped_ns_, t_ns) < kLasting;
    if (!recently) known_ = kClear * P.diagonal().cwiseSqrt();
    jumped_ns_ = t_ns;
    sum_ = BiasChanges{};
  }
  if (jumped_ns_ && seconds_between(*jumped_ns_, t_ns) < kLasting) {
    const Vector6 fault = bias_sigma(kGyroFault, kAccelFault).cwiseMax(known_);
    const Eigen::Array<bool, 6, 1> faulty = moved_.array().abs() > fault.array();
    jump.fault = {faulty.head<3>().any(), faulty.tail<3>().any()};
  }
  const double dt = judged_ns_ ? seconds_between(*judged_ns_, t_ns) : INFINITY;
  const double kept = std::exp(-dt / kStale);
  judged_ns_ = t_ns;
  sum_.correction *= kept;
  sum_.lowered *= kept;
  moved_ *= kept;
  return jump;
}

}  // namespace ear
