#include "filter/sources/wheels/wheel_agreement.h"

#include <cmath>

namespace ear {
namespace {

constexpr double kMemory = 0.05;    // [s] over which the gyroscope's noise is averaged
constexpr double kSlack = 0.02;     // [m/s] the ground's shape under two wheels, without any slip
constexpr double kSlipEnds = 0.15;  // [s] of agreement before a row that failed its gate is used again
constexpr double kSigmas = 3.0;
constexpr double kPause = 0.1;    // [s]
constexpr double kReturn = 0.15;  // [s] without contradiction
constexpr double kCloser = 0.5;   // the share of the limit that counts as agreement again

}  // namespace

bool agrees_again(TimeNs& since_ns, bool passes, TimeNs t_ns) {
  if (!passes) {
    since_ns = kDisagrees;
    return false;
  }
  if (since_ns == kDisagrees) since_ns = t_ns;
  return seconds_between(since_ns, t_ns) >= kSlipEnds;
}

void WheelAgreement::add(double difference, double sigma, TimeNs t_ns) {
  const double dt = any_ ? seconds_between(last_ns_, t_ns) : 0.0;
  if (!any_ || dt > kPause) *this = WheelAgreement{};
  any_ = true;
  last_ns_ = t_ns;
  difference_ += (1.0 - std::exp(-dt / kMemory)) * (difference - difference_);

  const double limit = (agree_ ? 1.0 : kCloser) * (kSlack + kSigmas * sigma);
  if (std::abs(difference_) > limit) {
    agree_ = false;
    contradiction_ns_ = t_ns;
  } else if (!agree_ && seconds_between(contradiction_ns_, t_ns) > kReturn) {
    agree_ = true;
  }
}

}  // namespace ear
