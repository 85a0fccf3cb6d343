#include "filter/health/rotation_check.h"

#include <algorithm>
#include <cmath>

#include "filter/health/image_health.h"
#include "filter/ingest/evidence.h"

namespace ear {
namespace {

constexpr double kTurnOff = 0.012;      // [rad/s] chosen: between gyroscope and cameras
constexpr double kTurnMemory = 0.25;    // [s] chosen
constexpr double kScatterMemory = 2.0;  // [s] chosen
constexpr double kMostScatter = 0.1;    // [rad/s] chosen
constexpr double kMisled = 1.5;         // [s] chosen: after wheels that did not fit

}  // namespace

void RotationCheck::add(const FrameAgreement& seen, double interval, bool wheels_rejected, TimeNs t_ns) {
  const double share = 1.0 - std::exp(-interval / kTurnMemory);
  if (wheels_rejected) misled_ns_ = t_ns;
  const bool misled = misled_ns_ && seconds_between(*misled_ns_, t_ns) < kMisled;
  const bool known = !misled && seen.turn_known && seen.left < ImageHealth::kManyOff && !seen.frozen;
  const Eigen::Vector3d rate = known ? Eigen::Vector3d(seen.turn / interval) : Eigen::Vector3d::Zero();
  // How far the rates scatter, vibration and timing included, and what is left of it in their mean.
  const double off = std::min((rate - rate_).norm(), kMostScatter);
  const double scatter_share = 1.0 - std::exp(-interval / kScatterMemory);
  scatter_ += scatter_share * (off * off - scatter_);
  rate_ += share * (rate - rate_);
  apparent_ += share * (seen.apparent_rate - apparent_);
  const double by_chance = kClear * std::sqrt(0.5 * share * scatter_);
  differs_ = known && rate_.norm() > std::max(kTurnOff, by_chance) + apparent_;
}

}  // namespace ear
