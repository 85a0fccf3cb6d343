// Filter: how the state moves on with the inertial samples, and what is done about those that cannot be right.
#include "filter/filter.h"

#include <cmath>

namespace ear {
namespace {

constexpr double kAccelSpike = 25.0;      // [m/s^2] of one sample from the mean of its neighbours
constexpr double kGyroSpike = 2.0;        // [rad/s] the same
constexpr double kSpikeRatio = 4.0;       // and so many times the difference of these
constexpr double kGapNoiseFactor = 10.0;  // on the noise densities while a gap in the IMU data is bridged
constexpr double kGapAccel = 1.0;         // [m/s^2] while nothing was measured
constexpr double kGapRate = 0.3;          // [rad/s] the same
constexpr double kDoubtfulTurn = 5e-3;    // [rad] standard deviation of what one inertial sample adds
constexpr double kSettles = 0.07;         // [s] after a bridge
constexpr double kImageSoon = 0.25;       // [s] so long readings wait for one
constexpr double kBiasDelay = 0.3;        // [s] until a bias that jumped is found out

}  // namespace

/// One sample that is far from both its neighbours, which agree with each other, is a fault of the sensor or its bus:
/// no strike lasts for one sample only. The mean of the neighbours takes its place.
void Filter::mend_spike(const ImuSample& next) {
  if (imu_.size() < 2) return;
  const ImuSample& before = imu_[imu_.size() - 2];
  const ImuSample& suspect = imu_.newest();
  if (seconds_between(before.t_ns, next.t_ns) > config_.max_imu_gap) return;
  const auto spike = [](const Eigen::Vector3d& a, const Eigen::Vector3d& b, const Eigen::Vector3d& c, double least) {
    const double off = (b - 0.5 * (a + c)).norm();
    return off > least && off > kSpikeRatio * (c - a).norm();
  };
  const bool gyro = spike(before.gyro_B, suspect.gyro_B, next.gyro_B, kGyroSpike);
  const bool accel = spike(before.accel_B, suspect.accel_B, next.accel_B, kAccelSpike);
  if (!gyro && !accel) return;
  monitor_.accuse_imu(gyro, accel, next.t_ns);
  imu_.correct_newest(0.5 * (before.gyro_B + next.gyro_B), 0.5 * (before.accel_B + next.accel_B));
  guard_.count_spike();
}

/// The vehicle may be turned, faster and elsewhere by these standard deviations [rad, m/s, m], each way, whatever was
/// measured so far. A turn is about the body: by the invariant error, nu = dv + [v]x theta, rho = dp + [p]x theta.
void Filter::doubt_motion(double rotation, double velocity, double position) {
  Eigen::Matrix<double, 9, 3> J;
  J << Eigen::Matrix3d::Identity(), skew(state_.imu.v_W), skew(state_.imu.p_WB);
  Eigen::Matrix<double, 9, 9> Q = rotation * rotation * J * J.transpose();
  Q.diagonal().segment<3>(err::nu).array() += velocity * velocity;
  Q.diagonal().segment<3>(err::rho).array() += position * position;
  covariance_.widen(err::theta, Q);
}

void Filter::advance(TimeNs t_ns) {
  if (t_ns <= state_.imu.t_ns) return;
  ErrorTransition total;
  const double duration = seconds_between(state_.imu.t_ns, t_ns);
  imu_.for_each_piece(
      state_.imu.t_ns, t_ns,
      [&](const Eigen::Vector3d& gyro_B, const Eigen::Vector3d& accel_B, double dt, const ImuNoiseFactors& factors) {
        ImuCalibration noise = calibration_.imu;
        noise.gyro_noise *= factors.gyro;
        noise.accel_noise *= factors.accel / trust(MotionSensor::imu);
        if (noise.gyro_noise * std::sqrt(dt) > kDoubtfulTurn) doubt_imu();
        if (imu_gap_ && state_.imu.t_ns >= imu_gap_->from_ns) {
          noise.gyro_noise *= kGapNoiseFactor;
          noise.accel_noise *= kGapNoiseFactor;
        }
        chain(total, error_transition(state_.imu, gyro_B, accel_B, dt, noise));
        state_.imu = integrate(state_.imu, gyro_B, accel_B, dt);
        rate_B_ = gyro_B - state_.imu.b_g;
      });
  state_.imu.t_ns = t_ns;
  const double walk = config_.odometer.normal_walk;
  const double distance = encoder_ ? state_.imu.v_W.norm() * duration : 0.0;
  covariance_.propagate(total, tangent_basis(state_.ground.n_W), walk * walk * distance);
  doubt_imu_gap();
}

/// Where samples are missing, they may be lost, or the clock jumped: the vehicle went on meanwhile, or it did not. What
/// it did, it did all the time: the standard deviations grow with the time.
void Filter::doubt_imu_gap() {
  if (!imu_gap_ || state_.imu.t_ns <= imu_gap_->from_ns) return;
  ImuGap& gap = *imu_gap_;
  const bool over = state_.imu.t_ns >= gap.to_ns;
  const double share =
      over ? 1.0 : seconds_between(gap.from_ns, state_.imu.t_ns) / seconds_between(gap.from_ns, gap.to_ns);
  const double T = gap.unseen * std::sqrt(share * share - gap.doubted * gap.doubted);
  gap.doubted = share;
  if (over) imu_gap_.reset();
  doubt_imu();
  doubt_motion(T * std::hypot(rate_B_.norm(), kGapRate), kGapAccel * T, T * state_.imu.v_W.norm());
}

/// Samples since the last image may be wrong by more than noise.
void Filter::doubt_imu() {
  if (!doubtful_since_ns_) doubtful_since_ns_ = state_.imu.t_ns;
}

/// With an attitude that may be some degrees off, wheels and lasers would be linearized in the wrong place: the next
/// image comes first, if there is one soon.
bool Filter::waits_for_bridge() const {
  if (!any_image_ || calibration_.cameras.size() < 2) return false;
  const auto since = [this](TimeNs t_ns) { return seconds_between(t_ns, state_.imu.t_ns); };
  return (imu_gap_ && since(imu_gap_->from_ns) > 0.0) ||
         (doubtful_since_ns_ && since(*doubtful_since_ns_) < kImageSoon) ||
         (bridged_ns_ && since(*bridged_ns_) < kSettles);
}

/// Propagates to t_ns, taking in wheels and lasers on the way: each at its own time, or, if the state has passed that
/// already, where the state was then.
void Filter::advance_measuring(TimeNs t_ns) {
  while (!turns_.empty() || !ranges_.empty()) {
    const auto middle = [](const WheelIncrement& turn) { return turn.from_ns + (turn.to_ns - turn.from_ns) / 2; };
    const bool wheels_next = !turns_.empty() && (ranges_.empty() || middle(turns_.front()) < ranges_.front().t_ns);
    const TimeNs next_ns = wheels_next ? middle(turns_.front()) : ranges_.front().t_ns;
    if (next_ns > t_ns) break;
    advance(next_ns);
    const bool used = !waits_for_bridge();
    if (wheels_next) {
      if (!used) {
        displacement_.reset();
      } else if (config_.odometer.update == OdometerUpdate::velocity) {
        update_with_wheels(turns_.front());
      } else if (rolls_at(turns_.front().from_ns)) {
        if (displacement_turns_.full()) displacement_turns_.pop();
        displacement_turns_.push(turns_.front());
      } else {
        displacement_.reset();
      }
      passed_turn_ = turns_.front();
      turns_.pop();
    } else {
      if (used) update_with_beams(ranges_.front());
      ranges_.pop();
    }
  }
  advance(t_ns);
}

Filter::Motion Filter::motion_at(TimeNs t_ns) const {
  const ImuState& x = state_.imu;
  Motion motion{x.R_WB, x.v_W};
  if (t_ns >= x.t_ns) return motion;
  Eigen::Matrix3d turned = Eigen::Matrix3d::Identity();  // from the body then to the body now
  Eigen::Vector3d gained = Eigen::Vector3d::Zero();      // velocity, in the body then, without gravity
  imu_.for_each_piece(t_ns, x.t_ns, [&](const Eigen::Vector3d& gyro_B, const Eigen::Vector3d& accel_B, double dt) {
    gained += turned * (accel_B - x.b_a) * dt;
    turned *= exp_so3((gyro_B - x.b_g) * dt);
  });
  motion.R_WB = x.R_WB * turned.transpose();
  motion.v_W = x.v_W - kGravity_W * seconds_between(t_ns, x.t_ns) - motion.R_WB * gained;
  return motion;
}

void Filter::update(const Eigen::Ref<const Eigen::MatrixXd>& H, int first_column,
                    const Eigen::Ref<const Eigen::VectorXd>& r, bool by_image) {
  const int considered = learn_calibration_ ? 0 : err::calibration_size;
  const auto variance = [this] { return covariance_.matrix().diagonal().segment<6>(err::b_g); };
  const BiasWatch::Vector6 before = variance();
  const Eigen::Ref<const Eigen::VectorXd> correction = covariance_.update(H, first_column, r, err::camera, considered);
  if (!correction.allFinite()) return;  // the covariance shows it: possible()
  bias_watch_.add(correction.segment<6>(err::b_g), before - variance(), by_image);
  boxplus_in_place(state_, correction);
}

/// A bias that jumped is as little known as at the start, and took the motion along until it was found out.
void Filter::watch_biases(double dt) {
  const BiasWatch::Verdict jumped = bias_watch_.judge(dt);
  if (!jumped.gyro && !jumped.accel) return;
  const double gyro = jumped.gyro ? config_.prior.gyro_bias : 0.0;
  const double accel = jumped.accel ? config_.prior.accel_bias : 0.0;
  doubt_motion(gyro * kBiasDelay, accel * kBiasDelay, 0.5 * accel * kBiasDelay * kBiasDelay);
  Eigen::Matrix<double, 6, 1> sigma;
  sigma << Eigen::Vector3d::Constant(gyro), Eigen::Vector3d::Constant(accel);
  covariance_.widen(err::b_g, sigma.cwiseAbs2().asDiagonal().toDenseMatrix());
  monitor_.accuse_imu(jumped.gyro, jumped.accel, state_.imu.t_ns);
}

NavState Filter::predict_here(TimeNs t_ns) const { return nav_state(integrate_to(t_ns, state_.imu, imu_)); }

}  // namespace ear
