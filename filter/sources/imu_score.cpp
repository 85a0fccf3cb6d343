#include "filter/sources/imu_score.h"

#include <algorithm>
#include <cmath>

namespace ear {
namespace {

// Chosen, of the fit's covariance: it counts each observation of the later frame by itself, but what the earlier one
// leaves wrong of a feature is common to both cameras.
constexpr double kCommon = 3.0;
constexpr double kStill = 0.9;  // chosen: of the features that fit one motion; where fewer do, something else moves

}  // namespace

void ImuScore::add_rest(const ImuStatistics& rest, const ImuCalibration& stated) {
  if (rest.count < kFewestForNoise) return;
  at_rest_ = {std::max(1.0, rest.gyro_density / stated.gyro_noise),
              std::max(1.0, rest.accel_density / stated.accel_noise)};
}

void ImuScore::add(const ImuMotion& motion, const StereoMotion& images, const Covariance& P, TimeNs t_ns) {
  if (images.fitting < kStill * images.matches) return;
  StereoMotion seen = images;
  seen.covariance *= kCommon;
  const Eigen::Matrix3d by_state = motion.by_state(P);
  const Eigen::Vector3d shift = seen.p_B0B1 - motion.p_BiBj;
  const Eigen::Matrix3d shift_variance = by_state + seen.p_covariance();
  for (int axis = 0; axis < 3; ++axis) {
    const double noise = motion.covariance(axis, axis) * at_rest_.accel * at_rest_.accel;
    accel_.add(shift(axis), {shift_variance(axis, axis), noise}, t_ns);
  }
  const Eigen::Matrix3d believed = by_state + motion.covariance * std::pow(at_rest_.accel / accel_.weight(), 2);
  const ExcessTurn turn = turn_beyond(seen, motion.R_BiBj, motion.p_BiBj, believed);
  for (int axis = 0; axis < 3; ++axis) {
    const double bias = P.matrix()(err::b_g + axis, err::b_g + axis) * motion.duration * motion.duration;
    gyro_.add(turn.value(axis),
              {bias + turn.covariance(axis, axis), motion.turn_variance * at_rest_.gyro * at_rest_.gyro}, t_ns);
  }
}

ImuNoiseFactors ImuScore::noise() const {
  if (!adapts_) return {};
  return {at_rest_.gyro / gyro_.weight(), at_rest_.accel / accel_.weight()};
}

}  // namespace ear
