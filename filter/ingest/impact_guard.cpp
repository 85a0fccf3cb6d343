#include "filter/ingest/impact_guard.h"

#include <algorithm>
#include <cmath>

#include "filter/ingest/limits.h"

namespace ear {
namespace {

constexpr double kAccelShare = 0.1;  // chosen: of a deviation: bandwidth, scale and timing make that much of it wrong
constexpr double kFull = 0.98;       // chosen: of the range or more is clipped
constexpr double kFlat = 1e-6;       // chosen: relative: two extreme values as equal as this were cut off

}  // namespace

double ExcessWatch::add(const Eigen::Vector3d& value, double dt) {
  if (!any_) {
    any_ = true;
    last_ = mean_ = value;
  }
  const Eigen::Vector3d deviation = value - mean_;
  const double distance = deviation.norm();
  const double ordinary = std::max(least_, kClear * std::sqrt(variance_));
  const bool cut_off = clips_ = clipped(value);
  last_ = value;

  const bool strikes = distance > ordinary;
  lasts_ = strikes || cut_off ? lasts_ + 1 : 0;

  // What is out of the ordinary counts as if it were at its limit: one strike does not move the mean, and a lasting
  // change becomes the new mean. Nor do strikes, however many, make strikes ordinary: that takes what lies between.
  const double counted = std::min(distance, ordinary);
  const double share = 1.0 - std::exp(-dt / memory_);
  if (distance > 0.0) mean_ += share * counted / distance * deviation;
  if (!strikes) variance_ += share * (counted * counted - variance_);

  // The errors of one strike have one sign. White noise adds up as they do if the k-th sample has 2 k - 1 times the
  // variance: n samples then have n^2 times that of one.
  const double coherent = std::sqrt(std::max(0.0, 2.0 * lasts_ - 1.0));
  if (cut_off) return coherent * std::max(distance, least_);
  return strikes ? coherent * error_share_ * distance : 0.0;
}

/// At the end of a known range; or, where it is not known, at the level of a flat top: the same extreme value twice.
bool ExcessWatch::clipped(const Eigen::Vector3d& value) {
  const double largest = value.cwiseAbs().maxCoeff();
  if (range_ > 0.0) return largest > kFull * range_;
  if (largest > (1.0 + kFlat) * clip_level_) clip_level_ = 0.0;  // it was no limit
  for (int axis = 0; axis < 3; ++axis) {
    const bool extreme = std::abs(value(axis) - mean_(axis)) > least_;
    if (extreme && std::abs(value(axis) - last_(axis)) < kFlat * std::abs(value(axis))) {
      clip_level_ = std::max(clip_level_, std::abs(value(axis)));
    }
  }
  return clip_level_ > 0.0 && largest > (1.0 - kFlat) * clip_level_;
}

/// No body turns so suddenly: all of a deviation of the rate may be wrong. The mean follows what bodies do to within
/// that.
ImpactGuard::ImpactGuard(const ImpactConfig& config)
    : gyro_(config.gyro_range, config.gyro_deviation, config.gyro_deviation / kTurnRate, 1.0),
      accel_(config.accel_range, config.accel_deviation, kStreamGap, kAccelShare) {}

ImuNoiseFactors ImpactGuard::add(const ImuSample& sample, const SampleSigma& sigma) {
  const double dt = last_ns_ ? seconds_between(*last_ns_, sample.t_ns) : 0.0;
  last_ns_ = sample.t_ns;
  return {std::hypot(1.0, gyro_.add(sample.gyro_B, dt) / sigma.gyro),
          std::hypot(1.0, accel_.add(sample.accel_B, dt) / sigma.accel)};
}

}  // namespace ear
