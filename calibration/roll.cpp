#include "calibration/roll.h"

#include <Eigen/Cholesky>
#include <cmath>

namespace ear::calibration {
namespace {

constexpr double kSlow = 0.15;   // [m/s] below, the direction is that of the axle and the ground
constexpr double kFloor = 2e-5;  // [m] of any path: roundness, play, interpolation of the readings
constexpr double kTwoPi = 6.283185307179586;

/// One point of the axle along the path.
struct PointPath {
  double length = 0.0;                               ///< forward positive [m]
  Eigen::Vector3d chord = Eigen::Vector3d::Zero();   ///< in the body at the keyframe
  Eigen::Vector3d along = Eigen::Vector3d::UnitX();  ///< mean direction, forward
};

/// The direction forward: across the axle, along the ground, or along the velocity where there is enough of it.
Eigen::Vector3d forward(const Eigen::Vector3d& v, const Eigen::Vector3d& y, const Eigen::Vector3d& n) {
  const Eigen::Vector3d flat = y.cross(n).normalized();
  const Eigen::Vector3d across = v - v.dot(y) * y;
  if (across.norm() < kSlow || std::abs(across.dot(flat)) < 0.7 * across.norm()) return flat;
  return across.normalized() * (across.dot(flat) < 0.0 ? -1.0 : 1.0);
}

PointPath point_path(const std::vector<PathNode>& path, const Eigen::Vector3d& lever, const Eigen::Vector3d& y_B,
                     const Eigen::Vector3d& n_k) {
  PointPath result;
  Eigen::Vector3d along = Eigen::Vector3d::Zero();
  for (std::size_t i = 0; i + 1 < path.size(); ++i) {
    const PathNode& a = path[i];
    const PathNode& b = path[i + 1];
    const Eigen::Vector3d step = b.p_kt + b.R_kt * lever - a.p_kt - a.R_kt * lever;
    const double dt = seconds_between(a.t_ns, b.t_ns);
    const Eigen::Vector3d direction = forward(step / dt, a.R_kt * exp_so3(0.5 * dt * a.rate_B) * y_B, n_k);
    result.length += direction.dot(step);
    result.chord += step;
    along += (step.norm() + 1e-9) * direction;
  }
  result.along = along.normalized();
  return result;
}

/// Sideways of the middle of the axle: how far it went along the axle, and the same of the chord.
double sideways(const std::vector<PathNode>& path, const Eigen::Vector3d& lever, const Eigen::Vector3d& y_B) {
  double result = 0.0;
  for (std::size_t i = 0; i + 1 < path.size(); ++i) {
    const PathNode& a = path[i];
    const PathNode& b = path[i + 1];
    const double dt = seconds_between(a.t_ns, b.t_ns);
    const Eigen::Vector3d y = a.R_kt * exp_so3(0.5 * dt * a.rate_B) * y_B;
    result += y.dot(b.p_kt + b.R_kt * lever - a.p_kt - a.R_kt * lever);
  }
  return result;
}

Eigen::Matrix3d whitening(const RollSetting& setting, const Eigen::Vector2d& rolled, double way, double duration) {
  const double r = setting.now.wheel_radius.mean();
  const double count = kTwoPi / static_cast<double>(setting.encoder.resolution) * r;
  const double read =
      std::sqrt(2.0 * (setting.encoder.noise_counts * setting.encoder.noise_counts + 1.0 / 12.0)) * count;
  const double pitch = r * setting.imu.gyro_noise * std::sqrt(duration);
  const RollNoise& noise = setting.noise;
  Eigen::Matrix3d covariance = Eigen::Matrix3d::Zero();
  covariance.topLeftCorner<2, 2>().setConstant(pitch * pitch + noise.common * noise.common * way);
  for (int side = 0; side < 2; ++side) {
    covariance(side, side) += read * read + kFloor * kFloor + noise.slip * noise.slip * std::abs(rolled(side));
  }
  covariance(2, 2) = kFloor * kFloor + noise.side_slip * noise.side_slip * way;
  return covariance.llt().matrixL().solve(Eigen::Matrix3d::Identity());
}

}  // namespace

OdometerState odometer_of(const EncoderCalibration& encoder) {
  OdometerState result;
  result.wheel_radius << encoder.wheel_radius[0], encoder.wheel_radius[1];
  result.track_width = encoder.track_width;
  result.T_BO = {encoder.T_BO.linear(), encoder.T_BO.translation()};
  return result;
}

std::optional<RollModel> roll_along(const std::vector<PathNode>& path, const Eigen::Vector3d& b_g,
                                    const Eigen::Vector3d& n_k, const WheelAngles& angles, const RollSetting& setting) {
  if (path.size() < 2) return std::nullopt;
  const TimeNs from_ns = path.front().t_ns;
  const TimeNs to_ns = path.back().t_ns;
  const auto from = angles.angle(from_ns);
  const auto to = angles.angle(to_ns);
  const auto speed_from = angles.speed(from_ns);
  const auto speed_to = angles.speed(to_ns);
  if (!from || !to || !speed_from || !speed_to) return std::nullopt;

  RollModel roll;
  roll.given = setting.given;
  roll.angle = *to - *from;
  roll.speed_gained = *speed_to - *speed_from;
  roll.duration = seconds_between(from_ns, to_ns);
  for (std::size_t i = 0; i + 1 < path.size(); ++i) {
    roll.turned += (path[i].rate_B + b_g) * seconds_between(path[i].t_ns, path[i + 1].t_ns);
  }
  const OdometerState& now = setting.now;
  const Eigen::Vector3d y_B = now.T_BO.R.col(1);
  Eigen::Vector2d rolled;
  for (int side = 0; side < 2; ++side) {
    const Eigen::Vector3d lever = now.T_BO.p + (side == 0 ? 0.5 : -0.5) * now.track_width * y_B;
    const PointPath wheel = point_path(path, lever, y_B, n_k);
    roll.along[static_cast<std::size_t>(side)] = wheel.along;
    roll.bend(side) = wheel.length - wheel.along.dot(wheel.chord);
    rolled(side) = wheel.length;
  }
  roll.R_im = at(path, from_ns + (to_ns - from_ns) / 2).R_kt;
  const PathNode& end = path.back();
  const Eigen::Vector3d chord = end.p_kt + end.R_kt * now.T_BO.p - now.T_BO.p;
  roll.bend(2) = sideways(path, now.T_BO.p, y_B) - (roll.R_im * y_B).dot(chord);
  roll.whitening = whitening(setting, rolled, 0.5 * (std::abs(rolled(0)) + std::abs(rolled(1))), roll.duration);
  return roll;
}

}  // namespace ear::calibration
