#include "filter/sources/imu_score.h"

#include <algorithm>
#include <cmath>

#include "filter/ekf/so3.h"
#include "filter/ingest/limits.h"

namespace ear {
namespace {

// Chosen, of the fit's covariance: it counts each observation of the later frame by itself, but what the earlier one
// leaves wrong of a feature is common to both cameras.
constexpr double kCommon = 3.0;
constexpr double kStill = 0.9;  // chosen: of the features that fit one motion; where fewer do, something else moves

}  // namespace

void ImuScore::add_rest(const ImuStatistics& rest, const ImuCalibration& stated) {
  if (rest.count < kToKnow) return;
  at_rest_ = {std::max(1.0, rest.gyro_density / stated.gyro_noise),
              std::max(1.0, rest.accel_density / stated.accel_noise)};
}

void ImuScore::MeanExcess::add(const Eigen::Vector3d& value, const Eigen::Vector3d& noise, double by_calibration,
                               double kept) {
  count = kept * count + 1.0;
  sum = kept * sum + value;
  variance = kept * kept * variance + noise;
  apparent = kept * apparent + by_calibration;
}

Innovation ImuScore::MeanExcess::worst(const Eigen::Vector3d& common) const {
  Innovation worst;
  for (int axis = 0; axis < 3; ++axis) {
    const double mean_variance = variance(axis) / (count * count) + apparent / count + std::max(0.0, common(axis));
    const Innovation mean = Innovation::of(sum(axis) / count, mean_variance, kClear * kClear);
    if (axis == 0 || mean.value * mean.value * worst.variance > worst.value * worst.value * mean.variance) worst = mean;
  }
  return worst;
}

/// A mean over many frames shows what is too small to be seen in one of them: a bias that jumped, a velocity that is
/// wrong. The noise averages out in it; what the state does not know of these does not, nor what the errors of the
/// cameras' calibration make look like motion.
void ImuScore::add_excess(const Excess& turn, const Excess& way, const ImuMotion& motion, const Covariance& P,
                          TimeNs t_ns) {
  const double dt = motion.duration;
  const double since = last_.t_ns ? seconds_between(*last_.t_ns, t_ns) : kStale;
  const auto variance = [&P](int entry) { return std::max(0.0, P.matrix()(entry, entry)); };
  const Eigen::Vector3d rate_B = log_so3(motion.T_BiBj.R) / dt, velocity_B = motion.T_BiBj.p / dt;
  Eigen::Vector3d turned = Eigen::Vector3d::Zero(), accel = Eigen::Vector3d::Zero();
  if (since < kStale) {
    turned = (rate_B - last_.rate_B) / dt;
    accel = (velocity_B - last_.velocity_B) / dt;
  }
  last_ = {t_ns, rate_B, velocity_B};
  const double kept = std::exp(-std::max(0.0, since) / kStale);
  const double mounting = P.matrix().diagonal().segment<3>(err::camera).cwiseMax(0.0).maxCoeff();
  const double pointing = mounting + variance(err::lens(0)), offset = variance(err::time_offset);
  turn_.add(turn.value / dt,
            (turn.covariance.diagonal().array() + motion.turn_variance * std::pow(learned().gyro, 2)) / (dt * dt),
            rate_B.squaredNorm() * (pointing + variance(err::gyro_matrix)) + turned.squaredNorm() * offset, kept);
  way_.add(way.value / dt, (way.covariance + motion.covariance * std::pow(learned().accel, 2)).diagonal() / (dt * dt),
           velocity_B.squaredNorm() * (pointing + kPrecise * kPrecise) + accel.squaredNorm() * offset, kept);
}

Innovation ImuScore::turn_excess(const Covariance& P) const {
  return turn_.worst(P.matrix().diagonal().segment<3>(err::b_g));
}

Innovation ImuScore::way_excess(const Covariance& P) const {
  return way_.worst(Eigen::Vector3d::Constant(P.matrix().diagonal().segment<3>(err::nu).maxCoeff()));
}

bool ImuScore::add(const ImuMotion& motion, const StereoMotion& images, const Covariance& P, TimeNs t_ns) {
  if (!(motion.duration > 0.0) || images.fitting < kStill * images.matches) return false;
  StereoMotion seen = images;
  seen.covariance *= kCommon;
  const Eigen::Matrix3d by_state = motion.by_state(P);
  const Eigen::Vector3d shift = seen.T_B0B1.p - motion.T_BiBj.p;
  const Eigen::Matrix3d shift_variance = by_state + seen.p_covariance();
  for (int axis = 0; axis < 3; ++axis) {
    const double noise = motion.covariance(axis, axis) * at_rest_.accel * at_rest_.accel;
    accel_.add(shift(axis), {shift_variance(axis, axis), noise}, t_ns);
  }
  const Eigen::Matrix3d by_samples = motion.covariance * std::pow(learned().accel, 2);
  const Excess turn = turn_beyond(seen, motion.T_BiBj, by_state + by_samples);
  const double rate_variance = P.matrix().diagonal().segment<3>(err::b_g).maxCoeff();
  const Excess way = way_beyond(
      seen, motion.T_BiBj,
      motion.turn_variance * std::pow(learned().gyro, 2) + rate_variance * motion.duration * motion.duration);
  const bool usable = turn.value.allFinite() && turn.covariance.allFinite() && P.matrix().diagonal().allFinite() &&
                      way.value.allFinite() && way.covariance.allFinite();
  if (usable) add_excess(turn, way, motion, P, t_ns);
  for (int axis = 0; axis < 3; ++axis) {
    const double bias = P.matrix()(err::b_g + axis, err::b_g + axis) * motion.duration * motion.duration;
    gyro_.add(turn.value(axis),
              {bias + turn.covariance(axis, axis), motion.turn_variance * at_rest_.gyro * at_rest_.gyro}, t_ns);
  }
  return usable;
}

ImuNoiseFactors ImuScore::noise() const { return adapts_ ? learned() : ImuNoiseFactors{}; }

}  // namespace ear
