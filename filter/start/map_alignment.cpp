#include "filter/start/map_alignment.h"

#include <algorithm>
#include <cmath>

#include "filter/ingest/stream_clock.h"

namespace ear {
namespace {

constexpr double kUnseenSpeed = 1.0;  // [m/s] chosen: that the vehicle may have gained since it was lost

/// Of a turn by the samples [rad^2]: their noise, with what those that are missing leave; and where it may be the clock
/// that jumped, the time is not known. As in Ekf::inflate_time.
double turn_variance(TimeNs from_ns, TimeNs to_ns, const Eigen::Vector3d& b_g, const ImuBuffer& imu,
                     double gyro_noise) {
  double variance = 0.0;
  imu.for_each_piece(
      from_ns, to_ns,
      [&](const Eigen::Vector3d& gyro_B, const Eigen::Vector3d&, double dt, const ImuNoiseFactors& noise) {
        variance += dt * std::pow(noise.gyro * gyro_noise, 2);
        if (is_clock_jump(dt)) variance += dt * dt * (gyro_B - b_g).squaredNorm();
      });
  return variance;
}

/// How far it may have gone since it was last known.
double unseen_path(const NavState& last, double seconds) { return seconds * (last.v_W.norm() + kUnseenSpeed); }

}  // namespace

MapAlignment MapAlignment::join(const NavState& last_W, const NavState& state_A, double yaw_sigma,
                                double position_sigma) {
  const Eigen::Matrix3d D = (last_W.q_WB * state_A.q_WB.conjugate()).toRotationMatrix();
  const double yaw = std::atan2(D(1, 0) - D(0, 1), D(0, 0) + D(1, 1));
  MapAlignment alignment;
  alignment.q_WA = Eigen::Quaterniond(Eigen::AngleAxisd(yaw, Eigen::Vector3d::UnitZ()));
  alignment.p_WA = last_W.p_WB - alignment.q_WA * state_A.p_WB;
  alignment.start_A = state_A.p_WB;
  alignment.yaw_sigma = yaw_sigma;
  alignment.position_sigma = position_sigma;
  return alignment;
}

void MapAlignment::doubt(const NavState& last_W, TimeNs t_ns) {
  position_sigma = std::max(position_sigma, unseen_path(last_W, seconds_between(last_W.t_ns, t_ns)));
}

NavState MapAlignment::to_world(const NavState& state_A) const {
  NavState state = state_A;
  state.q_WB = (q_WA * state_A.q_WB).normalized();
  state.p_WB = q_WA * state_A.p_WB + p_WA;
  state.v_W = q_WA * state_A.v_W;
  return state;
}

/// A yaw error e of the alignment turns the vehicle, its velocity, and its path since the start, about z.
ImuErrorMatrix MapAlignment::to_world(const ImuErrorMatrix& covariance_A, const NavState& state_A) const {
  namespace at = estimate_error;
  const bool same = q_WA.vec().isZero(0.0) && yaw_sigma == 0.0 && position_sigma == 0.0;
  if (same) return covariance_A;
  const Eigen::Matrix3d R = q_WA.toRotationMatrix();
  ImuErrorMatrix T = ImuErrorMatrix::Identity();
  for (const int block : {at::rotation, at::velocity, at::position}) T.block<3, 3>(block, block) = R;
  Eigen::Matrix<double, at::size, 1> by_yaw = Eigen::Matrix<double, at::size, 1>::Zero();
  by_yaw.segment<3>(at::rotation) = Eigen::Vector3d::UnitZ();
  by_yaw.segment<3>(at::velocity) = Eigen::Vector3d::UnitZ().cross(R * state_A.v_W);
  by_yaw.segment<3>(at::position) = Eigen::Vector3d::UnitZ().cross(R * (state_A.p_WB - start_A));
  ImuErrorMatrix P = T * covariance_A * T.transpose();
  P += yaw_sigma * yaw_sigma * by_yaw * by_yaw.transpose();
  P.diagonal().segment<3>(at::position).array() += position_sigma * position_sigma;
  return P;
}

MapAlignment align_after_restart(const Estimate& last_good, const ImuState& x, const ImuBuffer& imu,
                                 double gyro_noise) {
  NavState last = last_good.state;
  const auto variance = last_good.covariance.diagonal().cwiseMax(0.0);
  const TimeNs from_ns = std::min(last.t_ns, x.t_ns);
  const TimeNs to_ns = std::max(last.t_ns, x.t_ns);
  const double since = seconds_between(from_ns, to_ns);
  const double of_any_yaw = M_PI * M_PI / 3.0;  // variance
  double yaw_variance = variance(estimate_error::rotation + 2);
  if (imu[0].t_ns <= from_ns) {
    last.q_WB = last.q_WB * Eigen::Quaterniond(gyro_rotation(last.t_ns, x.t_ns, last.b_g, imu));
    yaw_variance += since * since * variance.segment<3>(estimate_error::gyro_bias).maxCoeff() +
                    turn_variance(from_ns, to_ns, last.b_g, imu, gyro_noise);
    yaw_variance = std::min(yaw_variance, of_any_yaw);
  } else {
    yaw_variance = of_any_yaw;
  }
  const double path = unseen_path(last, since);
  const double position_sigma = std::sqrt(variance.segment<3>(estimate_error::position).maxCoeff() + path * path);
  return MapAlignment::join(last, nav_state(x), std::sqrt(yaw_variance), position_sigma);
}

}  // namespace ear
