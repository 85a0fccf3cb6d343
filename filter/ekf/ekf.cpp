#include "filter/ekf/ekf.h"

#include <algorithm>
#include <cmath>

#include "filter/ekf/initial_state.h"
#include "filter/ekf/propagation.h"
#include "filter/ingest/limits.h"

namespace ear {
namespace {

constexpr double kUncertainTurn = 5e-3;  // [rad] chosen: standard deviation of one sample that images must confirm
// Measured, docs/decisions/0056: a rate over the gyroscope's noise density [1/sqrt(s)], a speed over its standard
// deviation. Those that are less show the clock of the cameras, and the gyroscope, by their errors, which the residuals
// have too.
constexpr double kAboveNoise = 50.0;

int error_capacity(const FilterConfig& config) { return err::clone(config.window + 1); }

/// Factor on the stated noise: what a sample has beyond it comes to the usual noise, whatever that is.
double excess(double of_sample, double usual) { return std::sqrt(usual * usual + of_sample * of_sample - 1.0); }

/// Calibration by a target shows how far away things are, the product of focal length and baseline, better than either:
/// by as much as the mean focal length is too large, the baseline is too short.
void correlate_baseline_and_lenses(const CameraState& cameras, const Eigen::VectorXd& sigma, Covariance& P) {
  if (!(sigma(err::baseline) > 0.0)) return;
  const Eigen::Vector3d shorter = -0.5 * cameras.T_C0C1.p;  // per relative error of one focal length
  Eigen::Matrix<double, err::calibration_size, err::calibration_size> added;
  added.setZero();
  constexpr int baseline = err::baseline - err::camera;
  for (int camera = 0; camera < 2; ++camera) {
    const int focal_length = err::lens(camera) - err::camera;
    const double variance = std::pow(sigma(err::lens(camera)), 2);
    added.block<3, 3>(baseline, baseline) += variance * shorter * shorter.transpose();
    added.block<3, 1>(baseline, focal_length) = variance * shorter;
    added.block<1, 3>(focal_length, baseline) = variance * shorter.transpose();
  }
  P.inflate(err::camera, added);
}

/// Is the velocity much more than its error?
bool moves(const ImuState& x, const Covariance& P) {
  const double variance = P.matrix().diagonal().segment<3>(err::nu).maxCoeff();
  return x.v_W.squaredNorm() > kAboveNoise * kAboveNoise * variance;
}

/// The first entry that is only considered: from there on, up to the clones.
int considered_from(CameraUpdate update, const Calibration& calibration, bool turns, const ImuState& x,
                    const Covariance& P) {
  if (update != CameraUpdate::learned || calibration.cameras.empty()) return err::camera;
  if (turns) return err::clones;
  return moves(x, P) ? err::gyro_matrix : err::time_offset;
}

}  // namespace

Ekf::Ekf(const FilterConfig& config, const Calibration& calibration)
    : calibration_(calibration),
      normal_prior_(config.odometer.normal_prior),
      wheel_apart_(std::sqrt(2.0) * config.prior.wheel_apart),
      gate_(config.gate_probability, 4 * (config.window + 1)),
      kernels_(filter_kernels(config.kernels)),
      covariance_(error_capacity(config), config.kernels) {
  state_.clones.reserve(static_cast<std::size_t>(config.window) + 1);
  reset();
}

void Ekf::start(const ImuState& x, const Eigen::VectorXd& sigma, bool scale_is_given) {
  running_ = true;
  state_.imu = x;
  started_ns_ = x.t_ns;
  started_W_ = x.p_WB;
  last_ = {};
  last_.mean_force_B = x.rest_force_B();
  turned_ = 0.0;
  turned_path_.setZero();
  covariance_.reset(sigma);
  correlate_baseline_and_lenses(state_.camera, sigma, covariance_);
  const Eigen::RowVector2d apart(1.0 / wheel_apart_, -1.0 / wheel_apart_);
  covariance_.update(apart, err::wheel_radius, Eigen::Matrix<double, 1, 1>::Zero());
  if (!scale_is_given) return;
  const Eigen::RowVector2d mean_is_known(0.5 / kKnownSigma, 0.5 / kKnownSigma);
  covariance_.update(mean_is_known, err::wheel_radius, Eigen::Matrix<double, 1, 1>::Zero());
}

void Ekf::assume(const State& x, const Eigen::Ref<const Eigen::MatrixXd>& P) {
  running_ = true;
  state_ = x;
  covariance_.reset(Eigen::VectorXd::Zero(P.rows()));
  covariance_.inflate(0, P);
}

void Ekf::reset() {
  running_ = false;
  state_.imu = ImuState{};
  state_.ground = GroundState{};
  state_.camera = camera_state(calibration_);
  state_.odometer = odometer_state(calibration_);
  state_.clones.clear();
  bias_changes_ = BiasChanges{};
}

std::optional<TimeNs> Ekf::propagate(const ImuBuffer& samples, TimeNs t_ns, const ImuNoiseFactors& usual,
                                     double normal_walk) {
  std::optional<TimeNs> uncertain_ns;
  if (t_ns <= state_.imu.t_ns) return uncertain_ns;
  std::optional<ErrorTransition> total;
  MatrixEffect by_matrix;
  const double duration = seconds_between(state_.imu.t_ns, t_ns);
  samples.for_each_piece(
      state_.imu.t_ns, t_ns,
      [&](const Eigen::Vector3d& gyro_B, const Eigen::Vector3d& accel_B, double dt, const ImuNoiseFactors& factors) {
        const ImuCalibration noise =
            with_factors(calibration_.imu, {excess(factors.gyro, usual.gyro), excess(factors.accel, usual.accel)});
        if (factors.gyro * calibration_.imu.gyro_noise * std::sqrt(dt) > kUncertainTurn && !uncertain_ns)
          uncertain_ns = state_.imu.t_ns;
        const ErrorTransition step = error_transition(state_.imu, gyro_B, accel_B, dt, noise);
        chain(by_matrix.gyro, step, gyro_B - state_.imu.b_g);
        const double share = std::min(1.0, dt / kStreamGap);
        last_.mean_force_B += share * (accel_B - state_.imu.b_a - last_.mean_force_B);
        chain(by_matrix.accel, step, last_.mean_force_B);
        if (total) {
          chain(kernels_, *total, step);
        } else {
          total = step;
        }
        last_.rate_B = state_.imu.rate_B(gyro_B);
        last_.mean_rate_B += share * (last_.rate_B - last_.mean_rate_B);
        turned_ += state_.imu.R_WB.row(2).dot(last_.rate_B) * dt;
        turned_path_ += turned_ * dt * state_.imu.v_W;
        const Eigen::Vector3d before_W = state_.imu.v_W;
        state_.imu = integrate(state_.imu, gyro_B, accel_B, dt);
        last_.accel_W = (state_.imu.v_W - before_W) / dt;
      });
  state_.imu.t_ns = t_ns;
  // Without a camera only what tilts the body counts: the heading would follow wheels whose track width is a guess.
  if (calibration_.cameras.empty()) leave_out_heading(by_matrix.gyro, state_.imu);
  last_.turns = last_.mean_rate_B.norm() > kAboveNoise * usual.gyro * calibration_.imu.gyro_noise;
  const double distance = state_.imu.v_W.norm() * duration;
  covariance_.propagate(total.value_or(ErrorTransition{}), by_matrix, tangent_basis(state_.ground.n_W),
                        normal_walk * normal_walk * distance);
  return uncertain_ns;
}

void Ekf::apply(GroundRows& z, double weight, CameraUpdate calibration) {
  for (int row = 0; row < z.count; ++row) {
    const double whitening = weight / z.sigma(row);
    z.H.row(row) *= whitening;
    z.residual(row) *= whitening;
  }
  if (z.count > 0) apply(z.H.topRows(z.count), err::nu, z.residual.head(z.count), calibration);
}

Eigen::Ref<const Eigen::VectorXd> Ekf::correction(const Eigen::Ref<const Eigen::MatrixXd>& H, int first_column,
                                                  const Eigen::Ref<const Eigen::VectorXd>& r,
                                                  CameraUpdate calibration) {
  const int considered = considered_from(calibration, calibration_, last_.turns, state_.imu, covariance_);
  return covariance_.correction(H, first_column, r, considered, err::clones - considered);
}

void Ekf::apply(const Eigen::Ref<const Eigen::MatrixXd>& H, int first_column,
                const Eigen::Ref<const Eigen::VectorXd>& r, CameraUpdate calibration) {
  const int considered = considered_from(calibration, calibration_, last_.turns, state_.imu, covariance_);
  const auto variance = [this] { return covariance_.matrix().diagonal().segment<6>(err::b_g); };
  const BiasChanges::Vector6 before = variance();
  const Eigen::Ref<const Eigen::VectorXd> correction =
      covariance_.update(H, first_column, r, considered, err::clones - considered);
  if (!correction.allFinite()) return;  // the covariance shows it: possible()
  bias_changes_.add(correction.segment<6>(err::b_g), before - variance());
  boxplus(state_, correction);
}

/// If the frame was taken a moment later than its stamp, the vehicle moved on: this is how the time offset is seen.
void Ekf::clone(double feature_noise, double weight) {
  const ImuState& x = state_.imu;
  const Eigen::Vector3d rate_W = x.R_WB * last_.rate_B;
  Eigen::Matrix<double, 6, 1> J_offset;
  J_offset << rate_W, x.v_W + x.p_WB.cross(rate_W);
  covariance_.append_clone(J_offset);
  state_.clones.push_back({next_frame_++, x.T_WB(), feature_noise, weight, x.t_ns});
}

void Ekf::marginalise(std::size_t clone) {
  covariance_.remove(err::clone(static_cast<int>(clone)), err::clone_size);
  state_.clones.erase(state_.clones.begin() + static_cast<std::ptrdiff_t>(clone));
}

void Ekf::move_origin() {
  const Eigen::Vector3d p_W = state_.imu.p_WB;
  covariance_.move_origin(p_W);
  state_.imu.p_WB.setZero();
  for (Clone& clone : state_.clones) clone.T_WB.p -= p_W;
  started_W_ -= p_W;
}

/// A rotation is about the body: by the invariant error, nu = dv + [v]x theta, rho = dp + [p]x theta.
void Ekf::inflate_motion(double rotation, double velocity, double position) {
  Eigen::Matrix<double, 9, 3> J;
  J << Eigen::Matrix3d::Identity(), skew(state_.imu.v_W), skew(state_.imu.p_WB);
  Eigen::Matrix<double, 9, 9> Q = rotation * rotation * J * J.transpose();
  Q.diagonal().segment<3>(err::nu).array() += velocity * velocity;
  Q.diagonal().segment<3>(err::rho).array() += position * position;
  covariance_.inflate(err::theta, Q);
}

/// By a constant force: velocity grows with the time since then, the way with its square.
void Ekf::inflate_held(const Eigen::Vector3d& v_W, const Eigen::Vector3d& p_W, double duration) {
  Eigen::Ref<Eigen::VectorXd> J = covariance_.room();
  J.setZero();
  J.segment<3>(err::nu) = v_W;
  J.segment<3>(err::rho) = p_W;
  for (std::size_t i = 0; i < state_.clones.size(); ++i) {
    const double share = 1.0 - seconds_between(state_.clones[i].t_ns, state_.imu.t_ns) / duration;
    if (share > 0.0) J.segment<3>(err::clone(static_cast<int>(i)) + 3) = share * share * p_W;
  }
  covariance_.inflate_along(J);
  bias_changes_ = BiasChanges::discarded();
}

/// One unknown for turn and velocity, along what the state does. How far the vehicle came has its own: it is known by
/// the velocity if samples were lost, and then what shows another turn shows no other place.
void Ekf::inflate_time(double seconds) {
  const ImuState& x = state_.imu;
  const Eigen::Vector3d rate_W = x.R_WB * last_.rate_B;
  Eigen::Matrix<double, 9, 2> J = Eigen::Matrix<double, 9, 2>::Zero();
  J.col(0) << rate_W, last_.accel_W + x.v_W.cross(rate_W), x.p_WB.cross(rate_W);
  J.col(1).tail<3>() = x.v_W;
  covariance_.inflate(err::theta, Eigen::Matrix<double, 9, 9>(seconds * seconds * J * J.transpose()));
}

/// A clone's motion is that between those before and after it, or the state.
void Ekf::inflate_clock(double seconds) {
  Eigen::Ref<Eigen::VectorXd> J = covariance_.room();
  J.setZero();
  J(err::time_offset) = seconds;
  const std::vector<Clone>& clones = state_.clones;
  for (std::size_t i = 0; i < clones.size(); ++i) {
    const Clone& from = clones[i > 0 ? i - 1 : 0];
    const bool last = i + 1 == clones.size();
    const Pose to = last ? state_.imu.T_WB() : clones[i + 1].T_WB;
    const double dt = seconds_between(from.t_ns, last ? state_.imu.t_ns : clones[i + 1].t_ns);
    if (!(dt > 0.0)) continue;
    const Eigen::Vector3d rate_W = from.T_WB.R * log_so3(from.T_WB.R.transpose() * to.R) / dt;
    const Eigen::Vector3d v_W = (to.p - from.T_WB.p) / dt;
    J.segment<6>(err::clone(static_cast<int>(i))) << seconds * rate_W, seconds * (v_W + clones[i].T_WB.p.cross(rate_W));
  }
  covariance_.inflate_along(J);
}

void Ekf::inflate(int first, const Eigen::Ref<const Eigen::VectorXd>& sigma) {
  for (int i = 0; i < sigma.size(); ++i) {
    covariance_.inflate(first + i, Eigen::Matrix<double, 1, 1>(sigma(i) * sigma(i)));
  }
}

void Ekf::restart_normal(const Eigen::Vector3d& n_W) {
  state_.ground.n_W = n_W;
  const Eigen::Vector2d sigma = Eigen::Vector2d::Constant(normal_prior_);
  covariance_.restart(err::normal, sigma);
}

void Ekf::restart_reading(int index, double sigma) {
  state_.odometer.reading_error(index) = 0.0;
  if (sigma == 0.0 && covariance_.matrix()(err::readings + index, err::readings + index) == 0.0) return;
  covariance_.restart(err::readings + index, Eigen::Matrix<double, 1, 1>(sigma));
}

BiasChanges Ekf::take_bias_changes() {
  const BiasChanges changes = bias_changes_;
  bias_changes_ = BiasChanges{};
  return changes;
}

bool Ekf::possible() const {
  const ImuState& x = state_.imu;
  const OdometerState& o = state_.odometer;
  const auto P = covariance_.matrix();
  const bool finite = std::abs(state_.camera.time_offset) <= kLargestTimeOffset &&
                      std::abs(o.time_offset) <= kLargestTimeOffset && x.R_WB.allFinite() && x.p_WB.allFinite() &&
                      x.v_W.allFinite() && x.b_g.allFinite() && x.b_a.allFinite() &&
                      state_.camera.T_BC0.R.allFinite() && state_.camera.T_BC0.p.allFinite() &&
                      o.wheel_radius.allFinite() && std::isfinite(o.track_width) && o.T_BO.R.allFinite() &&
                      o.T_BO.p.allFinite() && o.beam_offset.allFinite() && state_.ground.n_W.allFinite() &&
                      P.topLeftCorner<err::imu_size, err::imu_size>().allFinite() && P.diagonal().allFinite();
  const double reach = kFastest * (kLostAfter + seconds_between(started_ns_, x.t_ns));
  return finite && P.diagonal().minCoeff() >= 0.0 && (x.p_WB - started_W_).norm() < reach &&
         P.diagonal().segment<3>(err::rho).maxCoeff() < reach * reach;
}

/// From the invariant error to the ordinary one: dv = nu - [v]x theta, dp = rho - [p]x theta. Larger wheels make
/// distance and velocity longer alike; a gyroscope that measures too much turns the vehicle the more the more it
/// turned.
ImuErrorMatrix Ekf::ordinary_covariance(const UnseenScales& scales) const {
  const ImuState& x = state_.imu;
  ImuErrorMatrix P = covariance_.matrix().topLeftCorner<err::imu_size, err::imu_size>();
  const auto subtract = [&P](int entry, const Eigen::Vector3d& by_rotation) {
    const Eigen::Matrix3d J = skew(by_rotation);
    P.middleRows<3>(entry) -= J.lazyProduct(P.middleRows<3>(err::theta));
    P.middleCols<3>(entry) -= P.middleCols<3>(err::theta).lazyProduct(J.transpose());
  };
  subtract(estimate_error::velocity, x.v_W);
  subtract(estimate_error::position, x.p_WB);
  const auto add = [&P](double sigma, const Eigen::Vector3d& turn, const Eigen::Vector3d& v, const Eigen::Vector3d& p) {
    if (!(sigma > 0.0)) return;
    Eigen::Matrix<double, err::imu_size, 1> J = Eigen::Matrix<double, err::imu_size, 1>::Zero();
    J.segment<3>(estimate_error::rotation) = sigma * turn;
    J.segment<3>(estimate_error::velocity) = sigma * v;
    J.segment<3>(estimate_error::position) = sigma * p;
    P += J * J.transpose();
  };
  const Eigen::Vector3d up = Eigen::Vector3d::UnitZ();
  add(scales.length, Eigen::Vector3d::Zero(), x.v_W, x.p_WB - started_W_);
  add(scales.turn, turned_ * up, turned_ * up.cross(x.v_W), up.cross(turned_path_));
  return P;
}

}  // namespace ear
