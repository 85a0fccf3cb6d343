#include "calibration/noise_estimate.h"

#include <algorithm>
#include <cmath>

#include "filter/ingest/median.h"

namespace ear::calibration {
namespace {

constexpr double kShortest = 0.02;   // [m] of both wheels together
constexpr std::size_t kFewest = 30;  // intervals
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

double slip_walk(const std::vector<WheelDifference>& differences) {
  constexpr double kCut = 4.0;               // of a squared normalized error: a wheel that lost its grip counts no more
  constexpr double kMeanOfCut = 0.92054;     // of min(z^2, 4), z standard normal
  constexpr double kLargest = 1.0;           // [m/sqrt(m)]
  const auto score = [&](double variance) {  // derivative of the log-likelihood by the slip's variance per metre
    double sum = 0.0;
    for (const WheelDifference& difference : differences) {
      const double whole = difference.known + variance * difference.way;
      const double squared = difference.error * difference.error / whole;
      sum += difference.way / whole * (std::min(squared, kCut) / kMeanOfCut - 1.0);
    }
    return sum;
  };
  double low = 0.0, high = kLargest * kLargest;
  if (!(score(low) > 0.0)) return 0.0;
  for (int i = 0; i < 60; ++i) {
    const double middle = 0.5 * (low + high);
    (score(middle) > 0.0 ? low : high) = middle;
  }
  return std::sqrt(low);
}

std::optional<double> slip_of(const Segment& segment, const RollSetting& setting) {
  const WheelAngles angles(setting.encoder, segment.drive->encoders);
  const OdometerState& now = setting.now;
  const double count = kTwoPi / static_cast<double>(setting.encoder.resolution) * now.wheel_radius.mean();
  const double read = 2.0 * count * std::hypot(setting.encoder.noise_counts, 0.3);  // of two differences
  std::vector<WheelDifference> differences;
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
    const double gyro = now.track_width * setting.imu.gyro_noise;
    differences.push_back({rolled(1) - rolled(0) - yaw, gyro * gyro * duration + read * read, way});
  }
  if (differences.size() < kFewest) return std::nullopt;
  return slip_walk(differences);
}

}  // namespace ear::calibration
