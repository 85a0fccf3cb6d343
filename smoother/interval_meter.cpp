#include "smoother/interval_meter.h"

#include <algorithm>
#include <cmath>

#include "filter/ekf/propagation.h"

namespace ear::smoother {
namespace {

constexpr TimeNs kRateOver = 10'000'000;  // [ns] over which the rate at a frame is averaged
constexpr int kDirections = 3;            // in which the wheels are gated

WheelNoise noise_of(const OdometerConfig& odometer, const Calibration& calibration) {
  return calibration.encoder ? wheel_noise(odometer, *calibration.encoder, calibration.imu) : WheelNoise{};
}

std::vector<BeamRanges> ranges_until(TimeNs t_ns, double encoder_offset, Ingest& ingest) {
  std::vector<BeamRanges> ranges;
  while (const std::optional<Measurement> z = ingest.next(t_ns, encoder_offset)) {
    if (!z->increment) ranges.push_back(z->ranges);
  }
  return ranges;
}

}  // namespace

IntervalMeter::IntervalMeter(const FilterConfig& config, const Calibration& calibration)
    : odometer_(config.odometer),
      imu_(calibration.imu),
      wheel_noise_(noise_of(config.odometer, calibration)),
      gate_(config.gate_probability, kDirections),
      normal_(config.odometer, calibration, config.gate_probability) {}

void IntervalMeter::begin(bool stands) {
  normal_.forget();
  scores_ = {};
  was_still_ = stands;
}

NewFrame IntervalMeter::measure(const Situation& now, Ingest& ingest, Records& records) {
  NewFrame next;
  next.t_ns = now.t_ns;
  next.since.imu = preintegrate(now, ingest.imu());
  next.since.wheels = roll(now, ingest, records);
  next.since.still = now.stands && was_still_;
  next.rate_B = ingest.imu().mean_rate(now.t_ns - kRateOver, now.t_ns).gyro_B - now.x.imu.b_g;
  was_still_ = now.stands;
  return next;
}

ImuPreintegration IntervalMeter::preintegrate(const Situation& now, const ImuBuffer& imu) const {
  ImuPreintegration result(now.x.imu.b_g, now.x.imu.b_a);
  imu.for_each_piece(
      now.x.imu.t_ns, now.t_ns,
      [&](const Eigen::Vector3d& gyro_B, const Eigen::Vector3d& accel_B, double dt, const ImuNoiseFactors& factors) {
        const double accel = factors.accel / now.advice.of(MotionSensor::imu);
        result.add(gyro_B, accel_B, dt, with_factors(imu_, {factors.gyro, accel}));
      });
  return result;
}

/// What the wheels show of the interval, with its noise; nothing where they show nothing.
std::optional<WheelDisplacement> IntervalMeter::roll(const Situation& now, Ingest& ingest, Records& records) {
  std::vector<IncrementPart> parts;
  const bool complete =
      now.rolls && for_each_part(ingest.increments(), now.x.imu.t_ns, now.t_ns, [&](const IncrementPart& part) {
        parts.push_back(part);
        return true;
      });
  if (!complete) parts.clear();
  const std::vector<BeamRanges> ranges = ranges_until(now.t_ns, now.x.odometer.time_offset, ingest);
  if (!now.rolls) {
    normal_ns_ = now.t_ns;
    return std::nullopt;
  }
  std::optional<WheelDisplacement> z = integrate_wheels(now, parts, ranges, ingest.imu(), records);
  if (!z || !z->usable || !add_noise(*z, now, records)) return std::nullopt;
  return z;
}

/// (9): increment by increment, along the ground as the lasers last saw it.
std::optional<WheelDisplacement> IntervalMeter::integrate_wheels(const Situation& now,
                                                                 const std::vector<IncrementPart>& parts,
                                                                 const std::vector<BeamRanges>& ranges,
                                                                 const ImuBuffer& imu, Records& records) {
  const Eigen::Vector3d& b_g = now.x.imu.b_g;
  auto next = ranges.begin();
  const auto take_until = [&](TimeNs t_ns) {
    bool any = false;
    for (; next != ranges.end() && next->t_ns <= t_ns; ++next) {
      move_normal(next->t_ns, b_g, imu);
      any = normal_.add(*next, now.x.odometer, records) || any;
    }
    return any;
  };
  take_until(now.x.imu.t_ns);
  WheelPreintegration wheels(wheel_model(now.x.odometer), wheel_noise_);
  bool known = !parts.empty();
  bool started = false;
  for (const IncrementPart& part : parts) {
    speed_ = now.x.odometer.wheel_radius.mean() * part.angle.mean() / part.duration();
    const bool seen = take_until(middle_of(part));
    known = known && normal_.known();
    if (!known) continue;
    if (seen || !started) {
      const Eigen::Vector3d n_Bk = gyro_rotation(part.from_ns, normal_ns_, b_g, imu) * normal_.n_B();
      if (!started) wheels.start(n_Bk, b_g);
      wheels.set_normal(n_Bk, normal_.reading_sigma());
      started = true;
    }
    const MeanRate rate = imu.mean_rate(part.from_ns, part.to_ns);
    wheels.add_interval(rate.gyro_B, part.duration(), part.angle, rate.noise_factor);
  }
  take_until(now.t_ns);
  move_normal(now.t_ns, b_g, imu);
  return known ? std::optional(wheels.result()) : std::nullopt;
}

/// What is not in the pre-integration; and each direction in which the wheels do not agree with the inertial samples
/// shows nothing. False if none is left.
bool IntervalMeter::add_noise(WheelDisplacement& z, const Situation& now, Records& records) {
  const Eigen::Vector3d y_B = now.x.odometer.T_BO.R.col(1);
  auto covariance = z.covariance.topLeftCorner<3, 3>();
  covariance.diagonal().array() += std::pow(odometer_.speed_sigma * z.duration, 2);
  covariance += std::pow(odometer_.side_slip_turn * log_so3(z.R_BiBj).norm(), 2) * y_B * y_B.transpose();
  covariance /= std::pow(now.advice.of(MotionSensor::odometer), 2);

  const Displacement& wheels = now.displacements[index_of(MotionSensor::odometer)];
  const Displacement& inertial = now.displacements[index_of(MotionSensor::imu)];
  if (!wheels.available || !inertial.available) return false;
  const Eigen::Vector3d n_B = normal_.n_B();
  const Eigen::Vector3d ahead_B = y_B.cross(n_B).normalized();
  const std::array<Eigen::Vector3d, kDirections> directions = {ahead_B, y_B, n_B};
  int left = 0;
  for (std::size_t i = 0; i < directions.size(); ++i) {
    const Eigen::Vector3d& u = directions[i];
    const double d = u.dot(wheels.p_BiBj - inertial.p_BiBj);
    const double inertial_variance = u.dot(inertial.covariance * u);
    const double noise = u.dot(wheels.covariance * u);
    const bool fits = gate_.fits(d * d, inertial_variance + noise, 1);
    if (i == 0) {  // both wheels together, as a speed
      const double per_time = 1.0 / (z.duration * z.duration);
      const Innovation speed{d / z.duration, (inertial_variance + noise) * per_time, gate_.quantile(1), fits};
      for (const Source wheel : {Source::wheel_left, Source::wheel_right}) records.log.add(wheel, speed, now.t_ns);
    }
    const double factor = scores_[i].add(d, {inertial_variance, noise, true}, now.t_ns);
    covariance += (factor - 1.0) * u.dot(covariance * u) * u * u.transpose();
    left += scores_[i].fits() ? 1 : 0;
  }
  records.statistics.wheel_rows_used += left;
  records.statistics.wheel_rows_rejected += kDirections - left;
  return left > 0;
}

void IntervalMeter::move_normal(TimeNs t_ns, const Eigen::Vector3d& b_g, const ImuBuffer& imu) {
  if (normal_.known() && t_ns > normal_ns_) {
    normal_.move(gyro_rotation(normal_ns_, t_ns, b_g, imu), speed_ * seconds_between(normal_ns_, t_ns));
  }
  normal_ns_ = normal_.known() ? std::max(normal_ns_, t_ns) : t_ns;
}

}  // namespace ear::smoother
