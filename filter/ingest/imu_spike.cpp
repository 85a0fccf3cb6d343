#include "filter/ingest/imu_spike.h"

#include <algorithm>
#include <cmath>

#include "filter/ingest/limits.h"

namespace ear {
namespace {

constexpr double kShortestStrike = 0.0125;  // [s] chosen: the samples around a strike, of 10 ms, are further apart

/// What a line leaves of the integral over so many intervals of a random walk that is known at both ends, `q` being the
/// variance of a step: the variance of each of the samples that share it.
double left_by_line(double q, double intervals, double samples) {
  return q * std::pow(intervals, 3) / (12.0 * samples);
}

}  // namespace

bool SpikeWatch::add(ImuBuffer& samples, double dt, int lost, bool clips) {
  const Eigen::Vector3d value = samples.entry(0).sample.*value_;
  const Eigen::Vector3d before = samples.entry(doubt_.length + 1).sample.*value_;
  const Eigen::Vector3d change = value - (in_doubt() ? doubt_.measured[doubt_.length - 1] : before);
  const double spread = kClear * std::sqrt(step_variance_);
  const double limit = std::max({least_, least_rate_ * dt, spread});
  const double step = change.norm();
  const bool jumps = step > limit;

  if (in_doubt()) {
    doubt_.lost += static_cast<std::size_t>(lost);
    const double seconds = doubt_.seconds + dt;
    const double off = (doubt_.measured[doubt_.length - 1] - before).norm();
    if (jumps && doubt_.lost <= kLongest && (value - before).norm() <= kAlike * off) {
      replace(samples, seconds);
      last_change_.reset();
      return true;
    }
    const bool strike = strikes_ && (value - doubt_.measured[0]).norm() > kAlike * off;
    if (doubt_.length == kLongest || doubt_.lost > kLongest || strike) {
      give_up(samples);
      count(limit, seconds);
    }
  }
  if (!in_doubt() && lost > 0) {
    cross(samples, dt, lost);
    return false;
  }

  if (!jumps) {
    count(step, dt);
    if (last_change_) shared_ += (1.0 - std::exp(-dt / kStreamMemory)) * (change.dot(*last_change_) - shared_);
  }
  last_change_ = jumps ? std::nullopt : std::optional(change);
  const bool begins = jumps && samples.entry(1).noise.*factor_ == 1.0;
  if (in_doubt() || begins) {
    hold(samples, dt, clips);
  } else if (jumps) {
    count(limit, dt);
  }
  return false;
}

/// The newest sample may be part of a spike: the value before it is held.
void SpikeWatch::hold(ImuBuffer& samples, double dt, bool clips) {
  const Eigen::Vector3d before = samples.entry(doubt_.length + 1).sample.*value_;
  doubt_.seconds += dt;
  doubt_.clipped = doubt_.clipped || clips;
  doubt_.measured[doubt_.length++] = samples.entry(0).sample.*value_;
  for (std::size_t i = strikes_ && doubt_.length == 1 ? 1 : 0; i < doubt_.length; ++i) {
    ImuBuffer::Entry& held = samples.entry(doubt_.length - 1 - i);
    const double coherent = std::sqrt(2.0 * static_cast<double>(i) + 1.0);
    held.sample.*value_ = before;
    held.noise.*factor_ = std::max(held.noise.*factor_, coherent * (doubt_.measured[i] - before).norm() / sigma_);
  }
}

/// Between the samples before and after a spike the body did what it did in the recent past: a random walk with its
/// steps, known at both ends. What that leaves of the integral over n samples has the variance q (n + 1)^3 / 12, q of a
/// step. To this comes what the samples of the spike do not agree about. One or two may be true in a strike that fits
/// in between, and more if they are alike because they are clipped: then the sum of n has the standard deviation of n
/// of them.
void SpikeWatch::replace(ImuBuffer& samples, double seconds) {
  const auto n = static_cast<double>(doubt_.length);
  const Eigen::Vector3d before = samples.entry(doubt_.length + 1).sample.*value_;
  const Eigen::Vector3d slope = (samples.entry(0).sample.*value_ - before) / (n + 1.0);
  Eigen::Vector3d mean = Eigen::Vector3d::Zero(), square = Eigen::Vector3d::Zero();
  for (std::size_t i = 0; i < doubt_.length; ++i) {
    Eigen::Vector3d& crossed = samples.entry(doubt_.length - i).sample.*value_;
    crossed = before + static_cast<double>(i + 1) * slope;
    mean += (doubt_.measured[i] - crossed) / n;
    square += (doubt_.measured[i] - crossed).cwiseAbs2() / n;
  }
  const bool unresolved = doubt_.length <= 2 && seconds > kShortestStrike;
  const bool may_be_true = strikes_ && (unresolved || doubt_.clipped);
  const double disagreement = may_be_true ? n * square.sum() : square.sum() - mean.squaredNorm();
  const double variance =
      (left_by_line(step_variance_, n + static_cast<double>(doubt_.lost) + 1.0, n) + disagreement) / 3.0;
  for (std::size_t i = 0; i < doubt_.length; ++i) {
    samples.entry(doubt_.length - i).noise.*factor_ = std::max(1.0, std::sqrt(variance) / sigma_);
  }
  doubt_ = {};
}

/// As in a spike: what the line leaves of the integral over n samples lies between two that were measured. The step
/// across them says as much of the walk as those before.
void SpikeWatch::cross(ImuBuffer& samples, double dt, int lost) {
  const double n = lost;
  const double step = (samples.entry(0).sample.*value_ - samples.entry(1).sample.*value_).norm() / std::sqrt(n + 1.0);
  const double variance = left_by_line(std::max(step_variance_, step * step), n + 1.0, n + 2.0) / 3.0;
  double& factor = samples.entry(0).noise.*factor_;
  factor = std::max(factor, std::sqrt(variance) / sigma_);
  count(std::min(step, kClear * std::sqrt(step_variance_)), dt);
  last_change_.reset();
}

double SpikeWatch::white() const { return std::max(1.0, std::sqrt(std::max(0.0, -shared_) / 3.0) / sigma_); }

double SpikeWatch::held() const { return std::sqrt(step_variance_) / (3.0 * sigma_); }

void SpikeWatch::count(double step, double seconds) {
  step_variance_ += (1.0 - std::exp(-seconds / kStreamGap)) * (step * step - step_variance_);
}

void SpikeWatch::give_up(ImuBuffer& samples) {
  for (std::size_t i = 0; i < doubt_.length; ++i) samples.entry(doubt_.length - i).sample.*value_ = doubt_.measured[i];
  doubt_ = {};
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

ImuFault ImuSpikes::add(ImuBuffer& samples, double dt, int lost, bool accel_clips) {
  return {gyro_.add(samples, dt, lost, false), accel_.add(samples, dt, lost, accel_clips)};
}

}  // namespace ear
