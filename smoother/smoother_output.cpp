// Smoother: what is said of the newest state.
#include <algorithm>
#include <cmath>

#include "filter/sources/ground/ground_rows.h"
#include "smoother/smoother.h"

namespace ear::smoother {
namespace {

constexpr double kLongestPredict = 0.5;  // [s] beyond the newest sample
constexpr double kLostVelocity = 1.0;    // [m/s] standard deviation: lost
constexpr double kJump = 1.0;  // [m] from one frame to the next, beyond twice what the velocity explains: lost

Aiding aiding_of(const FrameStatistics& frame) {
  const bool cameras = frame.features_used > 0;
  const bool wheels = frame.wheel_rows_used > 0;
  if (cameras && wheels) return Aiding::cameras_and_wheels;
  if (cameras) return Aiding::cameras;
  if (wheels) return Aiding::wheels;
  return frame.standing ? Aiding::standing : Aiding::none;
}

}  // namespace

NavState Smoother::predict_here(TimeNs t_ns) const { return nav_state(integrate_to(t_ns, window_->newest(), imu_)); }

std::optional<NavState> Smoother::predict(TimeNs t_ns) const {
  if (!window_ || !is_time(t_ns) || seconds_between(imu_.newest().t_ns, t_ns) > kLongestPredict) return std::nullopt;
  return alignment_.to_world(predict_here(t_ns));
}

std::optional<RelativeMotion> Smoother::motion_to(TimeNs t_ns) const {
  if (!window_) return starter_->motion_to(t_ns);
  if (!is_time(t_ns) || !image_T_WB_ || t_ns <= last_image_ns_) return std::nullopt;
  return motion_between(*image_T_WB_, predict_here(imu_time(t_ns)));
}

Estimate Smoother::make_estimate() const {
  const NavState here = predict_here(window_->newest().t_ns);
  Estimate estimate;
  estimate.state = alignment_.to_world(here);
  estimate.covariance = alignment_.to_world(covariance_->state, here);
  estimate.frame = statistics_;
  estimate.consistency = consistency_;
  if (on_ground() && normal_.known()) estimate.terrain = terrain();
  return estimate;
}

/// The normal's error is counted from that of the attitude; in the world it turns along.
TerrainEstimate Smoother::terrain() const {
  const Eigen::Matrix3d R_WB = window_->newest().R_WB;
  const Eigen::Vector3d n_W = R_WB * normal_.n_B();
  const Slope ground = slope(R_WB * window_->odometer().T_BO.R.col(1), n_W);
  Eigen::Matrix<double, 5, 5> P = Eigen::Matrix<double, 5, 5>::Zero();
  P.topLeftCorner<3, 3>() = covariance_->state.topLeftCorner<3, 3>();
  const Eigen::Matrix2d turned = tangent_basis(n_W).transpose() * R_WB * tangent_basis(normal_.n_B());
  P.bottomRightCorner<2, 2>() = turned * normal_.covariance() * turned.transpose();
  const Eigen::Matrix2d P_slope = ground.J * P * ground.J.transpose();
  return {true, ground.along, ground.across, std::sqrt(P_slope(0, 0)), std::sqrt(P_slope(1, 1))};
}

/// Lost: no numbers, a velocity that nothing knows, or a jump that no velocity explains.
void Smoother::judge(const Estimate& estimate) {
  const auto variance = estimate.covariance.diagonal();
  const NavState& x = estimate.state;
  const bool finite =
      estimate.covariance.allFinite() && x.p_WB.allFinite() && x.v_W.allFinite() && x.q_WB.coeffs().allFinite();
  const double velocity = std::sqrt(variance.segment<3>(estimate_error::velocity).maxCoeff());
  double jump = 0.0;
  if (last_good_ && health_.status == HealthStatus::tracking) {
    const double speed = std::max(x.v_W.norm(), last_good_->state.v_W.norm());
    jump = (x.p_WB - last_good_->state.p_WB).norm() - 2.0 * speed * seconds_between(last_good_->state.t_ns, x.t_ns);
  }
  const bool lost = !finite || velocity > kLostVelocity || jump > kJump;
  const HealthStatus status = lost ? HealthStatus::lost : HealthStatus::tracking;
  if (status != health_.status) health_.since_ns = x.t_ns;
  health_.status = status;
  health_.aiding = lost ? Aiding::none : aiding_of(estimate.frame);
  health_.quality = lost ? 0 : 100;
  health_.horizontal_sigma = std::sqrt(variance.segment<2>(estimate_error::position).maxCoeff());
  health_.vertical_sigma = std::sqrt(variance(estimate_error::position + 2));
}

}  // namespace ear::smoother
