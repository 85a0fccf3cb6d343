#include "filter/ingest/ingest.h"

#include <cmath>
#include <utility>

#include "filter/ingest/limits.h"

namespace ear {
namespace {

/// Ingest::push of a reading from `begin` to `end`. Without a state what is too old for a start is forgotten.
template <typename T>
std::optional<TimeNs> append(Ring<T>& readings, const T& next, TimeNs T::*begin, TimeNs T::*end, bool has_state) {
  readings.push(next);
  if (has_state) return readings.full() ? std::optional(readings.front().*end) : std::nullopt;
  const auto too_old = [&] { return seconds_between(readings.front().*begin, next.*end) > kLostAfter; };
  while (readings.size() > 1 && (readings.full() || too_old())) readings.pop();
  return std::nullopt;
}

}  // namespace

Ingest::Ingest(const FilterConfig& config, const Calibration& calibration)
    : config_(config),
      calibration_(calibration),
      guard_(calibration),
      impact_guard_(config.impact),
      spikes_(config.impact, calibration.imu),
      imu_(kCapacity),
      increments_(kCapacity),
      ranges_(kCapacity) {
  if (calibration.encoder) encoder_.emplace(*calibration.encoder);
}

void Ingest::restart() {
  Ingest fresh(config_, calibration_);
  fresh.imu_clock_ = std::move(imu_clock_);
  fresh.encoder_clock_ = encoder_clock_;
  fresh.camera_clock_ = camera_clock_;
  fresh.even_clock_ = even_clock_;
  fresh.guard_ = std::move(guard_);
  fresh.guard_.restart();
  *this = std::move(fresh);
}

ImuVerdict Ingest::judge(const ImuSample& sample, bool has_state) {
  const ImuVerdict verdict = guard_.judge(sample);
  if (verdict.accepted && !verdict.begins_anew && !imu_.empty() && verdict.unseen + verdict.refused > 0.0) {
    if (!has_state) interruption_ = ImuInterruption{};
    const double time = imu_clock_.went_on_before(sample) ? 0.0 : std::max(verdict.unseen, verdict.refused);
    interruption_.add_gap(imu_.newest().t_ns, sample.t_ns, {time, verdict.refused});
  }
  return verdict;
}

ImuFault Ingest::store(const ImuSample& sample, const ImuVerdict& verdict) {
  const double dt = imu_.empty() ? INFINITY : seconds_between(imu_.newest().t_ns, sample.t_ns);
  const SampleSigma sigma(calibration_.imu, verdict.interval);
  ImuSample corrected = sample;
  corrected.gyro_B = calibration_.imu.gyro_matrix * sample.gyro_B;
  imu_.push(corrected, impact_guard_.add(sample, sigma));
  spikes_.set_sigma(sigma);
  ImuFault spike;
  if (imu_.size() == 1) {
    spikes_.give_up(imu_);
  } else {
    spike = spikes_.add(imu_, dt, verdict.lost, impact_guard_.accel_clips());
  }
  const ImuNoiseFactors held = spikes_.held();
  imu_.set_walk({held.gyro / verdict.interval, held.accel / verdict.interval});
  if (spike.any()) guard_.count_spike();
  return {spike.gyro || impact_guard_.gyro_clips(), spike.accel || impact_guard_.accel_clips()};
}

Ingest::Encoders Ingest::take(EncoderSample sample, std::optional<TimeNs> state_ns) {
  const std::optional<TimeNs> stamp = encoder_clock_.correct(sample.t_ns, now(), imu_interval());
  if (!stamp) return {guard_.refuse_encoder(), std::nullopt};
  sample.t_ns = *stamp;
  const Verdict verdict = guard_.judge(sample, state_ns, *encoder_);
  if (verdict != Verdict::accepted) return {verdict, std::nullopt};
  std::optional<WheelIncrement> increment = encoder_->add(sample);
  if (increment) even_clock_.correct(*increment);
  return {verdict, increment};
}

std::optional<TimeNs> Ingest::imu_due() const {
  return imu_.size() == kCapacity ? std::optional(imu_[kCapacity / 2].t_ns) : std::nullopt;
}

std::optional<TimeNs> Ingest::push(const WheelIncrement& increment, bool has_state) {
  return append(increments_, increment, &WheelIncrement::from_ns, &WheelIncrement::to_ns, has_state);
}

std::optional<TimeNs> Ingest::push(const BeamRanges& ranges, bool has_state) {
  return append(ranges_, ranges, &BeamRanges::t_ns, &BeamRanges::t_ns, has_state);
}

std::optional<Measurement> Ingest::next(TimeNs t_ns, double encoder_offset) {
  const auto wheels_at = [&] { return later_by(encoder_offset, middle_of(increments_.front())); };
  const bool wheels_next = !increments_.empty() && (ranges_.empty() || wheels_at() < ranges_.front().t_ns);
  if (!wheels_next && ranges_.empty()) return std::nullopt;
  Measurement measurement;
  measurement.t_ns = wheels_next ? wheels_at() : ranges_.front().t_ns;
  if (measurement.t_ns > t_ns) return std::nullopt;
  if (wheels_next) {
    measurement.increment = passed_increment_ = increments_.front();
    increments_.pop();
  } else {
    measurement.ranges = ranges_.front();
    ranges_.pop();
  }
  return measurement;
}

void Ingest::drop_before(TimeNs t_ns) {
  while (!increments_.empty() && increments_.front().from_ns < t_ns) increments_.pop();
  while (!ranges_.empty() && ranges_.front().t_ns < t_ns) ranges_.pop();
}

void Ingest::drop_readings() {
  increments_.clear();
  ranges_.clear();
  passed_increment_.reset();
}

/// The newest inertial sample, where that gives the time: not while its clock is in question.
std::optional<TimeNs> Ingest::now() const {
  if (imu_.empty() || imu_clock_.waiting() || guard_.refuses_imu()) return std::nullopt;
  return imu_.newest().t_ns;
}

double Ingest::imu_interval() const {
  return imu_.size() < 2 ? 0.0 : seconds_between(imu_[imu_.size() - 2].t_ns, imu_.newest().t_ns);
}

bool Ingest::covers(TimeNs imu_time_ns) const {
  return !imu_.empty() && seconds_between(imu_.newest().t_ns, imu_time_ns) < kClockJump;  // a driver may be held up
}

bool Ingest::waits_for_imu(std::optional<TimeNs> state_ns) const {
  return state_ns && spikes_.in_doubt() && seconds_between(*state_ns, imu_.newest().t_ns) < kStreamGap;
}

InputCounts Ingest::counts() const {
  InputCounts counts = guard_.counts();
  counts.clock_jumps =
      static_cast<std::uint64_t>(imu_clock_.jumps_corrected() + encoder_clock_.jumps() + camera_clock_.jumps());
  return counts;
}

}  // namespace ear
