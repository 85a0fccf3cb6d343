#include "filter/ingest/imu_spike.h"

#include <algorithm>
#include <cmath>

#include "filter/ingest/impact_guard.h"
#include "filter/ingest/limits.h"

namespace ear {
namespace {

// Chosen: of the deviation, between the samples of a spike, and between those before and after it; half a sine over
// three samples differs by 0.4.
constexpr double kAlike = 0.25;

}  // namespace

bool SpikeWatch::add(ImuBuffer& samples, double dt, bool no_strike, bool clips) {
  const Eigen::Vector3d value = samples.entry(0).sample.*value_;
  const Eigen::Vector3d before = samples.entry(length_ + 1).sample.*value_;
  const double step = (value - (length_ > 0 ? measured_[length_ - 1] : before)).norm();
  const bool may_be_strike = strikes_ && !no_strike;
  const double spread = kClear * std::sqrt(step_variance_);
  const double limit = std::max(strikes_ && no_strike ? 0.0 : std::max(least_, least_rate_ * dt), spread);
  const double counted = std::min(step, limit);
  step_variance_ += (1.0 - std::exp(-dt / kStreamGap)) * (counted * counted - step_variance_);

  if (length_ > 0) {
    const double off = (measured_[length_ - 1] - before).norm();
    if (step > limit && (value - before).norm() <= kAlike * off) {
      replace(samples, may_be_strike && length_ == 2);
      return true;
    }
    const bool strike = may_be_strike && (clips || (value - measured_[0]).norm() > kAlike * off);
    if (length_ == kLongest || strike) give_up(samples);
  }
  const bool begins = step > limit && samples.entry(1).noise.*factor_ == 1.0 && !(may_be_strike && clips);
  if (length_ == 0 && !begins) return false;
  measured_[length_++] = value;
  for (std::size_t i = may_be_strike && length_ == 1 ? 1 : 0; i < length_; ++i) {
    ImuBuffer::Entry& held = samples.entry(length_ - 1 - i);
    const double coherent = std::sqrt(2.0 * static_cast<double>(i) + 1.0);
    held.sample.*value_ = before;
    held.noise.*factor_ = std::max(held.noise.*factor_, coherent * (measured_[i] - before).norm() / sigma_);
  }
  return false;
}

/// Between the samples before and after a spike the body did what it did in the recent past: a random walk with its
/// steps, known at both ends. What that leaves of the integral over n samples has the variance q (n + 1)^3 / 12, q of a
/// step. To this comes what the samples of the spike do not agree about; `in_doubt` all of them: two samples of a
/// strike may be alike by chance.
void SpikeWatch::replace(ImuBuffer& samples, bool in_doubt) {
  const auto n = static_cast<double>(length_);
  const Eigen::Vector3d before = samples.entry(length_ + 1).sample.*value_;
  const Eigen::Vector3d slope = (samples.entry(0).sample.*value_ - before) / (n + 1.0);
  Eigen::Vector3d mean = Eigen::Vector3d::Zero(), square = Eigen::Vector3d::Zero();
  for (std::size_t i = 0; i < length_; ++i) {
    Eigen::Vector3d& crossed = samples.entry(length_ - i).sample.*value_;
    crossed = before + static_cast<double>(i + 1) * slope;
    mean += (measured_[i] - crossed) / n;
    square += (measured_[i] - crossed).cwiseAbs2() / n;
  }
  const double disagreement = square.sum() - (in_doubt ? 0.0 : mean.squaredNorm());
  const double variance = (step_variance_ * std::pow(n + 1.0, 3) / (12.0 * n) + disagreement) / 3.0;
  for (std::size_t i = 0; i < length_; ++i) {
    samples.entry(length_ - i).noise.*factor_ = std::max(1.0, std::sqrt(variance) / sigma_);
  }
  length_ = 0;
}

void SpikeWatch::give_up(ImuBuffer& samples) {
  for (std::size_t i = 0; i < length_; ++i) samples.entry(length_ - i).sample.*value_ = measured_[i];
  length_ = 0;
}

void ImuSpikes::give_up(ImuBuffer& samples) {
  gyro_.give_up(samples);
  accel_.give_up(samples);
}

ImuSpikes::ImuSpikes(const ImpactConfig& config, const ImuCalibration& imu)
    : gyro_(&ImuSample::gyro_B, &ImuNoiseFactors::gyro, SampleSigma(imu).gyro, 0.0, kTurnRate, false),
      accel_(&ImuSample::accel_B, &ImuNoiseFactors::accel, SampleSigma(imu).accel, config.accel_deviation, 0.0, true) {}

ImuFault ImuSpikes::add(ImuBuffer& samples, double dt, bool accel_clips) {
  const std::size_t accel_length = accel_.length();
  const bool together = gyro_.length() == accel_length;  // so far
  const bool gyro = gyro_.add(samples, dt, false, false);
  const bool no_strike = together && (gyro || gyro_.length() > accel_length);
  const bool accel = accel_.add(samples, dt, no_strike, accel_clips);
  return {gyro, accel};
}

}  // namespace ear
