#include "filter/ingest/imu_spike.h"

#include <algorithm>
#include <cmath>

#include "filter/ingest/limits.h"

namespace ear {
namespace {

// Chosen: of the deviation, between the samples of a spike, and between those before and after it; half a sine over
// three samples differs by 0.4.
constexpr double kAlike = 0.25;

/// What a line leaves of the integral over so many intervals of a random walk that is known at both ends, `q` being the
/// variance of a step: the variance of each of the samples that share it.
double left_by_line(double q, double intervals, double samples) {
  return q * std::pow(intervals, 3) / (12.0 * samples);
}

}  // namespace

bool SpikeWatch::add(ImuBuffer& samples, double dt, bool clips) {
  const Eigen::Vector3d value = samples.entry(0).sample.*value_;
  const Eigen::Vector3d before = samples.entry(length_ + 1).sample.*value_;
  const Eigen::Vector3d change = value - (length_ > 0 ? measured_[length_ - 1] : before);
  const double step = change.norm();
  const double spread = kClear * std::sqrt(step_variance_);
  const double limit = std::max({least_, least_rate_ * dt, spread});
  const double counted = std::min(step, limit);
  step_variance_ += (1.0 - std::exp(-dt / kStreamGap)) * (counted * counted - step_variance_);
  const Eigen::Vector3d counted_change = step > limit ? Eigen::Vector3d(change * (limit / step)) : change;
  shared_ += (1.0 - std::exp(-dt / kNoiseMemory)) * (counted_change.dot(last_change_) - shared_);
  last_change_ = counted_change;

  if (length_ > 0) {
    const double off = (measured_[length_ - 1] - before).norm();
    if (step > limit && (value - before).norm() <= kAlike * off) {
      replace(samples, strikes_ && length_ == 2);
      return true;
    }
    const bool strike = strikes_ && (clips || (value - measured_[0]).norm() > kAlike * off);
    if (length_ == kLongest || strike) give_up(samples);
  }
  const bool begins = step > limit && samples.entry(1).noise.*factor_ == 1.0 && !(strikes_ && clips);
  if (length_ == 0 && !begins) return false;
  measured_[length_++] = value;
  for (std::size_t i = strikes_ && length_ == 1 ? 1 : 0; i < length_; ++i) {
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
  const double variance = (left_by_line(step_variance_, n + 1.0, n) + disagreement) / 3.0;
  for (std::size_t i = 0; i < length_; ++i) {
    samples.entry(length_ - i).noise.*factor_ = std::max(1.0, std::sqrt(variance) / sigma_);
  }
  length_ = 0;
}

/// As in a spike: what the line leaves of the integral over n samples lies between two that were measured. The step
/// across them says as much of the walk as those before.
void SpikeWatch::cross(ImuBuffer& samples, double dt, int lost) {
  give_up(samples);
  const double n = lost;
  const double step = (samples.entry(0).sample.*value_ - samples.entry(1).sample.*value_).squaredNorm() / (n + 1.0);
  const double variance = left_by_line(std::max(step_variance_, step), n + 1.0, n + 2.0) / 3.0;
  double& factor = samples.entry(0).noise.*factor_;
  factor = std::max(factor, std::sqrt(variance) / sigma_);
  const double counted = std::min(step, kClear * kClear * step_variance_);
  step_variance_ += (1.0 - std::exp(-dt / kStreamGap)) * (counted - step_variance_);
}

double SpikeWatch::white() const { return std::max(1.0, std::sqrt(std::max(0.0, -shared_) / 3.0) / sigma_); }

double SpikeWatch::held() const { return std::sqrt(step_variance_) / (3.0 * sigma_); }

void SpikeWatch::give_up(ImuBuffer& samples) {
  for (std::size_t i = 0; i < length_; ++i) samples.entry(length_ - i).sample.*value_ = measured_[i];
  length_ = 0;
}

void ImuSpikes::cross(ImuBuffer& samples, double dt, int lost) {
  gyro_.cross(samples, dt, lost);
  accel_.cross(samples, dt, lost);
}

void ImuSpikes::give_up(ImuBuffer& samples) {
  gyro_.give_up(samples);
  accel_.give_up(samples);
}

ImuSpikes::ImuSpikes(const ImpactConfig& config, const ImuCalibration& imu)
    : gyro_(&ImuSample::gyro_B, &ImuNoiseFactors::gyro, SampleSigma(imu, 1.0 / imu.rate_hz).gyro, 0.0, kTurnRate,
            false),
      accel_(&ImuSample::accel_B, &ImuNoiseFactors::accel, SampleSigma(imu, 1.0 / imu.rate_hz).accel,
             config.accel_deviation, 0.0, true) {}

void ImuSpikes::set_sigma(const SampleSigma& sigma) {
  gyro_.set_sigma(sigma.gyro);
  accel_.set_sigma(sigma.accel);
}

ImuFault ImuSpikes::add(ImuBuffer& samples, double dt, bool accel_clips) {
  return {gyro_.add(samples, dt, false), accel_.add(samples, dt, accel_clips)};
}

}  // namespace ear
