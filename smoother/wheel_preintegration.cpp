#include "smoother/wheel_preintegration.h"

#include <cassert>
#include <cmath>

#include "filter/ekf/so3.h"

namespace ear::smoother {
namespace {

// Chosen: sine of the angle between axle and normal: below it, the vehicle lies on its side.
constexpr double kMinSine = 0.5;
// Chosen: sine of the angle at which a wheel climbs beside the middle of the axle: above it, that is a jolt at low
// speed.
constexpr double kMaxClimb = 0.5;

/// Forward along the ground, unit: f = unit(y x n) (6)-(8), and its derivatives.
struct Heading {
  double sine = 0.0;  ///< of the angle between axle and normal
  Eigen::Vector3d f;
  Eigen::Matrix3d J_axle, J_normal;
  Eigen::Matrix3d J_rotation;  ///< by a rotation that turns the axle, and not the normal
};

Heading heading_along_ground(const Eigen::Vector3d& axle, const Eigen::Vector3d& normal) {
  const Eigen::Vector3d across = axle.cross(normal);
  Heading heading;
  heading.sine = across.norm();
  heading.f = across / heading.sine;
  const Eigen::Matrix3d J_across = (Eigen::Matrix3d::Identity() - heading.f * heading.f.transpose()) / heading.sine;
  heading.J_axle = -J_across * skew(normal);
  heading.J_normal = J_across * skew(axle);
  heading.J_rotation = -heading.J_axle * skew(axle);
  return heading;
}

/// How far the middle of the axle went when the wheels rolled, and its derivatives.
struct Advance {
  double distance = 0.0;  ///< [m]
  Eigen::Vector2d J_rolled = Eigen::Vector2d::Zero();
  double J_climb = 0.0;
};

/// `rolled` [m], left and right; `climb` [m]: how far the one rose and the other sank beside the middle. That is part
/// of what they rolled, not of the distance ahead.
Advance advance_of_middle(const Eigen::Vector2d& rolled, double climb) {
  Advance advance;
  for (int wheel = 0; wheel < 2; ++wheel) {
    const double slant = rolled(wheel);
    if (std::abs(climb) >= kMaxClimb * std::abs(slant)) {
      advance.distance += 0.5 * slant;
      advance.J_rolled(wheel) = 0.5;
      continue;
    }
    const double ahead = std::copysign(std::sqrt(slant * slant - climb * climb), slant);
    advance.distance += 0.5 * ahead;
    advance.J_rolled(wheel) = 0.5 * slant / ahead;
    advance.J_climb -= 0.5 * climb / ahead;
  }
  return advance;
}

}  // namespace

WheelModel wheel_model(const OdometerState& odometer) {
  WheelModel wheels;
  wheels.radius = odometer.wheel_radius;
  wheels.track_width = odometer.track_width;
  wheels.y_B = odometer.T_BO.R.col(1);
  return wheels;
}

WheelNoise wheel_noise(const OdometerConfig& odometer, const EncoderCalibration& encoder, const ImuCalibration& imu) {
  WheelNoise noise;
  noise.gyro = imu.gyro_noise;
  noise.reading = encoder.noise_counts * 2.0 * M_PI / static_cast<double>(encoder.resolution);
  noise.slip = odometer.slip;
  noise.side_slip = odometer.side_slip;
  noise.roughness = odometer.roughness;
  noise.normal_walk = odometer.normal_walk;
  return noise;
}

void WheelPreintegration::start(const Eigen::Vector3d& n_Bi, const Eigen::Vector3d& b_g) {
  *this = WheelPreintegration(wheels_, noise_);
  n_Bi_ = n_Bi;
  n_Bi_start_ = n_Bi;
  b_g_ = b_g;
  J_.block<3, 3>(kNormal, kStartNormal).setIdentity();
}

void WheelPreintegration::set_normal(const Eigen::Vector3d& n_Bk, double sigma) {
  n_Bi_ = R_BiBk_ * n_Bk;
  // n = R n_Bk: its error is that of the rotation, and its own. Nothing of the normal before remains.
  const Eigen::Matrix3d J_normal_xi = -skew(n_Bi_);
  const Eigen::Matrix<double, 3, kErrors> by_errors = J_normal_xi * Q_.middleRows<3>(kXi);
  J_.middleRows<3>(kNormal) = J_normal_xi * J_.middleRows<3>(kXi);
  Q_.middleRows<3>(kNormal) = by_errors;
  Q_.middleCols<3>(kNormal) = by_errors.transpose();
  Q_.block<3, 3>(kNormal, kNormal) =
      by_errors.middleCols<3>(kXi) * J_normal_xi.transpose() + sigma * sigma * J_normal_xi * J_normal_xi.transpose();
}

void WheelPreintegration::add_interval(const Eigen::Vector3d& gyro_B, double dt, const Eigen::Vector2d& turn,
                                       double gyro_factor) {
  assert(dt > 0.0);
  const Eigen::Vector3d rate = gyro_B - b_g_;
  const Eigen::Vector3d half_turn = 0.5 * dt * rate;
  const Eigen::Matrix3d R_half = R_BiBk_ * exp_so3(half_turn);  // body at the middle of the interval to B_i

  const Heading heading = heading_along_ground(R_half * wheels_.y_B, n_Bi_);
  if (!(heading.sine > kMinSine)) {
    usable_ = false;
    return;
  }
  // (5), and the roll of the axle on uneven ground.
  const Eigen::Vector2d rolled = wheels_.radius * (rate.dot(wheels_.y_B) * dt) + wheels_.radius.cwiseProduct(turn);
  const Eigen::Vector3d lever_rate_Bi = 0.5 * wheels_.track_width * dt * (R_half * rate);
  const double climb = lever_rate_Bi.dot(heading.f);
  const Advance advance = advance_of_middle(rolled, climb);

  // Derivatives of alpha = distance * f by f, and of the distance by the wheels' turn and by the rate.
  const Eigen::Matrix3d J_alpha_f =
      advance.distance * Eigen::Matrix3d::Identity() + advance.J_climb * heading.f * lever_rate_Bi.transpose();
  const Eigen::Vector2d J_distance_turn = wheels_.radius.cwiseProduct(advance.J_rolled);
  const Eigen::RowVector3d J_distance_rate =
      dt * (J_distance_turn.sum() * wheels_.y_B.transpose() +
            0.5 * wheels_.track_width * advance.J_climb * heading.f.transpose() * R_half);

  // (10), (11): how errors of rotation and normal (F), and of the parameters (G), go over into alpha.
  const Eigen::Matrix3d J_alpha_xi =
      J_alpha_f * heading.J_rotation - advance.J_climb * heading.f * heading.f.transpose() * skew(lever_rate_Bi);
  const Eigen::Matrix3d J_half_bias = -R_BiBk_ * gamma<1>(half_turn) * (0.5 * dt);
  Eigen::Matrix<double, kErrors, kErrors> F = Eigen::Matrix<double, kErrors, kErrors>::Identity();
  F.block<3, 3>(kAlpha, kXi) = J_alpha_xi;
  F.block<3, 3>(kAlpha, kNormal) = J_alpha_f * heading.J_normal;
  Eigen::Matrix<double, kErrors, kParameters> G = Eigen::Matrix<double, kErrors, kParameters>::Zero();
  G.block<3, 3>(kAlpha, kBias) = J_alpha_xi * J_half_bias - heading.f * J_distance_rate;
  G.block<3, 3>(kXi, kBias) = -R_BiBk_ * gamma<1>(2.0 * half_turn) * dt;
  G.block<3, 2>(kAlpha, kRadius) = heading.f * rolled.cwiseProduct(advance.J_rolled).transpose();
  G.block<3, 1>(kAlpha, kTrackWidth) = heading.f * advance.J_climb * climb;
  G.block<3, 3>(kAlpha, kAxle) =
      J_alpha_f * heading.J_axle * R_half + dt * J_distance_turn.sum() * heading.f * rate.transpose();
  J_ = (F.lazyProduct(J_) + G).eval();

  // White noise of density s has the variance s^2 / dt in a mean over dt; it enters where the bias would.
  const Eigen::Matrix<double, kErrors, 3> by_gyro = G.middleCols<3>(kBias);
  const double path = 0.5 * rolled.cwiseAbs().sum();
  const Eigen::Vector3d left = n_Bi_.cross(heading.f);
  const auto squared = [](double value) { return value * value; };
  const Eigen::Matrix<double, kErrors, kErrors> FQ = F.lazyProduct(Q_);
  Q_ = FQ.lazyProduct(F.transpose());
  Q_ += squared(gyro_factor * noise_.gyro) / dt * by_gyro.lazyProduct(by_gyro.transpose());
  Q_.block<3, 3>(kAlpha, kAlpha) += path * (squared(noise_.slip) * heading.f * heading.f.transpose() +
                                            squared(noise_.side_slip) * left * left.transpose() +
                                            squared(noise_.roughness) * n_Bi_ * n_Bi_.transpose());
  Q_.block<3, 3>(kNormal, kNormal) +=
      path * squared(noise_.normal_walk) * (Eigen::Matrix3d::Identity() - n_Bi_ * n_Bi_.transpose());

  // A reading ends one interval and starts the next, with opposite signs: only the change of its weight remains.
  const Eigen::Matrix<double, 3, 2> weight = heading.f * J_distance_turn.transpose();
  const Eigen::Matrix<double, 3, 2> change = weight - reading_weight_;
  reading_squares_ += change * change.transpose();
  reading_weight_ = weight;

  alpha_ += advance.distance * heading.f;
  R_BiBk_ = renormalized(R_BiBk_ * exp_so3(2.0 * half_turn));
  duration_ += dt;
  distance_ += path;
}

WheelDisplacement WheelPreintegration::result() const {
  WheelDisplacement z;
  z.alpha_Bi = alpha_;
  z.R_BiBj = R_BiBk_;
  z.covariance = Q_.topLeftCorner<6, 6>();
  z.covariance.topLeftCorner<3, 3>() +=
      noise_.reading * noise_.reading * (reading_squares_ + reading_weight_ * reading_weight_.transpose());
  z.duration = duration_;
  z.distance = distance_;
  z.usable = usable_;
  z.b_g = b_g_;
  z.n_Bi = n_Bi_start_;
  z.wheels = wheels_;
  z.J_alpha_bias = J_.block<3, 3>(kAlpha, kBias);
  z.J_alpha_normal = J_.block<3, 3>(kAlpha, kStartNormal);
  z.J_alpha_radius = J_.block<3, 2>(kAlpha, kRadius);
  z.J_alpha_track_width = J_.block<3, 1>(kAlpha, kTrackWidth);
  z.J_alpha_axle = J_.block<3, 3>(kAlpha, kAxle);
  z.J_xi_bias = J_.block<3, 3>(kXi, kBias);
  return z;
}

}  // namespace ear::smoother
