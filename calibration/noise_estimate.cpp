#include "calibration/noise_estimate.h"

#include <algorithm>
#include <cmath>

#include "filter/ingest/median.h"

namespace ear::calibration {
namespace {

constexpr double kShortest = 0.02;   // [m] of both wheels together
constexpr std::size_t kFewest = 30;  // intervals
constexpr double kLeast = 1e-4;      // [m/sqrt(m)]
constexpr double kMedianToSigma = 1.4826;
constexpr double kTwoPi = 6.283185307179586;

/// Integrals of the rate over a path: about the ground's normal, and about the axle [rad].
struct Turned {
  double yaw = 0.0;
  double pitch = 0.0;
};

Turned turned_along(const std::vector<PathNode>& path, const Eigen::Vector3d& n_k, const Eigen::Vector3d& y_B) {
  Turned turned;
  for (std::size_t i = 0; i + 1 < path.size(); ++i) {
    const double dt = seconds_between(path[i].t_ns, path[i + 1].t_ns);
    turned.yaw += dt * n_k.dot(path[i].R_kt * path[i].rate_B);
    turned.pitch += dt * y_B.dot(path[i].rate_B);
  }
  return turned;
}

}  // namespace

double robust_sigma(std::vector<double> values) {
  if (values.empty()) return 0.0;
  for (double& value : values) value = std::abs(value);
  return kMedianToSigma * upper_median(values);
}

std::optional<double> slip_of(const Segment& segment, const RollSetting& setting) {
  const WheelAngles angles(setting.encoder, segment.drive->encoders);
  const OdometerState& now = setting.now;
  const double count = kTwoPi / static_cast<double>(setting.encoder.resolution) * now.wheel_radius.mean();
  const double read = 2.0 * count * std::hypot(setting.encoder.noise_counts, 0.3);  // of two differences
  std::vector<double> errors, known;
  for (const Keyframe& keyframe : segment.keyframes) {
    if (!keyframe.on_ground || keyframe.path.size() < 2) continue;
    const auto from = angles.angle(keyframe.t_ns);
    const auto to = angles.angle(keyframe.path.back().t_ns);
    if (!from || !to) continue;
    const double duration = seconds_between(keyframe.t_ns, keyframe.path.back().t_ns);
    const Eigen::Vector3d n_W = Eigen::Vector3d(-keyframe.ground[1], -keyframe.ground[2], 1.0).normalized();
    const Eigen::Vector3d n_k = state_of(keyframe).q_WB.conjugate() * n_W;
    const Turned turned = turned_along(keyframe.path, n_k, now.T_BO.R.col(1));
    const Eigen::Vector2d rolled = now.wheel_radius.cwiseProduct(*to - *from + Eigen::Vector2d::Constant(turned.pitch));
    const double way = rolled.cwiseAbs().sum();
    if (way < kShortest) continue;
    const double yaw = now.track_width * turned.yaw;
    errors.push_back((rolled(1) - rolled(0) - yaw) / std::sqrt(way));
    const double gyro = now.track_width * setting.imu.gyro_noise;
    known.push_back((gyro * gyro * duration + read * read) / way);
  }
  if (errors.size() < kFewest) return std::nullopt;
  const double sigma = robust_sigma(errors);
  return std::sqrt(std::max(kLeast * kLeast, sigma * sigma - upper_median(known)));
}

}  // namespace ear::calibration
