#include "filter/health/bias_watch.h"

#include <algorithm>
#include <cmath>

#include "filter/ingest/limits.h"

namespace ear {
namespace {

constexpr double kSigmas = 6.0;      // chosen: of the sum of the corrections: these do not happen by chance
constexpr double kGyroFault = 5e-3;  // [rad/s] measured: on sound sensors of public recordings up to 2.2e-3
constexpr double kAccelFault = 0.1;  // [m/s^2] measured: the same, up to 0.036

}  // namespace

BiasJump BiasWatch::judge(const BiasChanges& changes, TimeNs t_ns) {
  if (changes.restarted) {
    sum_ = BiasChanges{};
    moved_.setZero();
  }
  sum_.add(changes.correction, changes.variance_lowered);
  moved_ += changes.correction;
  BiasJump jump;
  for (int i = 0; i < 6; ++i) {
    const double correction = std::abs(sum_.correction(i));
    if (correction <= kSigmas * std::sqrt(sum_.variance_lowered(i))) continue;
    const bool gyro = i < 3;
    double& most = gyro ? jump.gyro : jump.accel;
    most = std::max(most, correction);
    if (std::abs(moved_(i)) > (gyro ? kGyroFault : kAccelFault)) (gyro ? jump.fault.gyro : jump.fault.accel) = true;
    sum_.correction(i) = sum_.variance_lowered(i) = 0.0;
  }
  const double dt = judged_ns_ ? seconds_between(*judged_ns_, t_ns) : INFINITY;
  const double kept = std::exp(-dt / kStale);
  judged_ns_ = t_ns;
  sum_.correction *= kept;
  sum_.variance_lowered *= kept * kept;
  moved_ *= kept;
  return jump;
}

}  // namespace ear
