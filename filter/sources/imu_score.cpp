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

/// A mean over many frames shows what is too small to be seen in one of them: a bias that jumped. The noise averages
/// out in it; the bias as the state knows it does not, nor what the errors of the cameras' mounting, focal length and
/// time offset make look like a turn. The same turns show whether the clocks differ.
std::optional<Innovation> ImuScore::add_excess(const Excess& turn, const ImuMotion& motion,
                                               const Eigen::Vector3d& rate_B, double apparent, const Covariance& P,
                                               TimeNs t_ns) {
  TurnExcess& e = turn_excess_;
  const double dt = motion.duration;
  if (!turn.value.allFinite() || !turn.covariance.allFinite() || !P.matrix().diagonal().allFinite())
    return std::nullopt;
  const double since = e.last_ns ? seconds_between(*e.last_ns, t_ns) : kStale;
  const auto variance = [&P](int entry) { return std::max(0.0, P.matrix()(entry, entry)); };
  const double kept = std::exp(-std::max(0.0, since) / kStale);
  e.count = kept * e.count + 1.0;
  e.apparent = kept * e.apparent + apparent;
  e.rate_B = rate_B;
  e.last_ns = t_ns;
  const double noise = motion.turn_variance * std::pow(learned().gyro, 2);
  clock_excess_.add({t_ns, dt, rate_B, turn.value / dt, (turn.covariance.trace() / 3.0 + noise) / (dt * dt)});
  Innovation worst;
  for (int axis = 0; axis < 3; ++axis) {
    e.rate(axis) = kept * e.rate(axis) + turn.value(axis) / dt;
    e.variance(axis) = kept * kept * e.variance(axis) + (turn.covariance(axis, axis) + noise) / (dt * dt);
    const double mean_variance =
        e.variance(axis) / (e.count * e.count) + e.apparent / e.count + variance(err::b_g + axis);
    const Innovation mean = Innovation::of(e.rate(axis) / e.count, mean_variance, kClear * kClear);
    if (axis == 0 || mean.value * mean.value * worst.variance > worst.value * worst.value * mean.variance) worst = mean;
  }
  return worst;
}

/// Where the images contradict the displacement too, it is less certain by so much, and that it is off, frames share:
/// the accelerometer may be to blame. By ten standard deviations, something else moves. The noise is that at rest: what
/// is learned takes a jump for noise.
void ImuScore::add_bias(const StereoMotion& seen, const ImuMotion& motion, const Eigen::Vector3d& rate_B,
                        const Eigen::Matrix3d& p_covariance, const State& x, const Covariance& P, TimeNs t_ns) {
  const Eigen::Vector3d shift = seen.T_B0B1.p - motion.T_BiBj.p;
  const double misfit = shift.dot((p_covariance + seen.p_covariance()).ldlt().solve(shift));
  if (!(misfit < kFarthest)) return;
  const Excess turn = turn_beyond(seen, motion.T_BiBj, std::max(1.0, misfit) * p_covariance);
  const double contradicted = std::max(0.0, 1.0 - 3.0 / misfit);  // the share that is no chance
  const double dt = motion.duration;
  const double predictable = turn.by_prediction.trace() / 3.0;
  const double shared = predictable + contradicted * turn.explained.squaredNorm() / 3.0;
  const double noise =
      turn.covariance.trace() / 3.0 - predictable + motion.turn_variance * at_rest_.gyro * at_rest_.gyro;
  const SeenTurn seen_turn{t_ns, dt, rate_B, turn.value / dt, noise / (dt * dt)};
  gyro_excess_.add({seen_turn, shared / (dt * dt), x.imu.b_g, x.camera.time_offset}, P);
}

void ImuScore::add_frame_turn(const Excess& turn, const ImuMotion& motion, double apparent, const Covariance& P) {
  FrameNoise::Seen seen;
  const Eigen::Array3d rate = P.matrix().diagonal().segment<3>(err::b_g).array() + apparent;
  seen.beyond = turn.value;
  seen.others = turn.covariance.diagonal().array() + rate * motion.duration * motion.duration;
  seen.noise.setConstant(motion.turn_variance);
  seen.believed = learned().gyro;
  frame_.add_turn(seen, motion.duration);
}

/// Depths have errors that all features share: a wrong length of each way.
void ImuScore::add_frame_way(const Excess& way, const ImuMotion& motion, const Eigen::Matrix3d& by_state,
                             const Covariance& P, TimeNs t_ns) {
  FrameNoise::Seen seen;
  const double dt = motion.duration;
  const Eigen::Array3d by_depths = (kPrecise * motion.T_BiBj.p).array().square();
  const double apparent = apparent_variance(P, motion.T_BiBj.p / dt, motion.gained_W / dt);
  seen.beyond = way.value;
  seen.others = (way.covariance + by_state).diagonal().array() + by_depths + apparent * dt * dt;
  seen.noise = motion.covariance.diagonal();
  seen.believed = learned().accel;
  frame_.add_way(seen, dt, t_ns);
}

std::optional<Innovation> ImuScore::add(const ImuMotion& motion, const StereoMotion& images, const State& x,
                                        const Covariance& P, TimeNs t_ns) {
  if (!(motion.duration > 0.0) || images.fitting < kStill * images.matches) return std::nullopt;
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
  const double dt = motion.duration;
  const Eigen::Vector3d rate_B = log_so3(motion.T_BiBj.R) / dt;
  add_bias(seen, motion, rate_B, by_state + by_samples, x, P, t_ns);
  const Excess turn = turn_beyond(seen, motion.T_BiBj, by_state + by_samples);
  const bool goes_on = turn_excess_.last_ns && seconds_between(*turn_excess_.last_ns, t_ns) < kStale;
  const Eigen::Vector3d change =
      goes_on ? Eigen::Vector3d((rate_B - turn_excess_.rate_B) / dt) : Eigen::Vector3d::Zero();
  const double apparent = apparent_turn_variance(P, rate_B, change);
  const std::optional<Innovation> excess = add_excess(turn, motion, rate_B, apparent, P, t_ns);
  add_frame_turn(turn, motion, apparent, P);
  const double turn_noise = motion.turn_variance * std::pow(std::max(learned().gyro, frame_.factors().gyro), 2);
  const double rate_variance = P.matrix().diagonal().segment<3>(err::b_g).maxCoeff();
  const Excess way = way_beyond(seen, motion.T_BiBj, turn_noise + rate_variance * dt * dt);
  add_frame_way(way, motion, by_state, P, t_ns);
  const Eigen::Matrix3d& R_WB = x.imu.R_WB;
  const Eigen::Matrix3d noise = R_WB * (way.covariance + by_samples) * R_WB.transpose() / (dt * dt);
  const Eigen::Matrix3d gained = 3.0 / (dt * dt) * R_WB * by_samples * R_WB.transpose();  // T of T^3 / 3
  accel_excess_.add({t_ns, dt, x.imu.v_W, motion.gained_W, gained.diagonal(), R_WB * way.value / dt, noise.diagonal()},
                    P);
  for (int axis = 0; axis < 3; ++axis) {
    const double bias = P.matrix()(err::b_g + axis, err::b_g + axis) * dt * dt;
    gyro_.add(turn.value(axis),
              {bias + turn.covariance(axis, axis), motion.turn_variance * at_rest_.gyro * at_rest_.gyro}, t_ns);
  }
  return excess;
}

ImuNoiseFactors ImuScore::noise() const {
  if (!adapts_) return {};
  const ImuNoiseFactors lasting = learned(), now = frame_.factors();
  return {std::max(lasting.gyro, now.gyro), std::max(lasting.accel, now.accel)};
}

}  // namespace ear
