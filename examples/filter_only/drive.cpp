// The filter behind a front end of one's own: tracks go in, estimates come out. It needs nothing but Eigen.
//
// A front end owes the filter, for each frame, the features seen in normalized image coordinates with ids that last as
// long as a feature is tracked. The one here looks at points around a vehicle that drives along a circle. At the end
// the program compares the estimated position with the true one, and fails if they differ.
#include <filter/filter.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <optional>
#include <random>
#include <vector>

namespace {

constexpr double kRadius = 2.0;     // [m] of the circle
constexpr double kSpeed = 0.8;      // [m/s]
constexpr double kStanding = 1.0;   // [s] before it drives
constexpr double kSpeedUp = 1.0;    // [s] from standing to full speed
constexpr double kDuration = 15.0;  // [s]
constexpr double kBaseline = 0.1;   // [m] between the cameras
constexpr double kFocal = 400.0;    // [px]
constexpr double kNoisePx = 0.5;    // [px] of one coordinate
constexpr double kTolerance = 0.1;  // [m] at the end, after 11 m
constexpr int kImuPerFrame = 10;
constexpr int kImuPerPrint = 200;
constexpr ear::TimeNs kImuPeriod = 5'000'000;

/// The vehicle at one time. Its world is the estimator's: it starts at the origin, along x.
struct Truth {
  double speed = 0.0;         // [m/s]
  double acceleration = 0.0;  // along the path [m/s^2]
  Eigen::Isometry3d T_WB = Eigen::Isometry3d::Identity();
};

Truth truth_at(double t) {
  const double driving = std::max(0.0, t - kStanding);
  const double ramp = std::min(driving, kSpeedUp);
  Truth truth;
  truth.acceleration = driving > 0.0 && driving < kSpeedUp ? kSpeed / kSpeedUp : 0.0;
  truth.speed = kSpeed * ramp / kSpeedUp;
  const double distance = 0.5 * kSpeed * ramp * ramp / kSpeedUp + kSpeed * (driving - ramp);
  const double yaw = distance / kRadius;
  truth.T_WB.linear() = Eigen::AngleAxisd(yaw, Eigen::Vector3d::UnitZ()).toRotationMatrix();
  truth.T_WB.translation() << kRadius * std::sin(yaw), kRadius * (1.0 - std::cos(yaw)), 0.0;
  return truth;
}

ear::ImuSample imu_at(ear::TimeNs t_ns) {
  const Truth truth = truth_at(1e-9 * static_cast<double>(t_ns));
  ear::ImuSample sample;
  sample.t_ns = t_ns;
  sample.gyro_B = {0.0, 0.0, truth.speed / kRadius};
  sample.accel_B = {truth.acceleration, truth.speed * truth.speed / kRadius, 9.81};
  return sample;
}

ear::Calibration describe_vehicle() {
  ear::CameraCalibration camera;  // looks along the body's x: its x is the body's -y, its y the body's -z
  camera.T_BC.linear() << 0, 0, 1, -1, 0, 0, 0, -1, 0;
  camera.width = 640;
  camera.height = 480;
  camera.fu = camera.fv = kFocal;  // the filter knows pixels by this only: its noise and thresholds are in pixels
  camera.cu = 319.5;
  camera.cv = 239.5;
  ear::Calibration calibration;
  calibration.cameras = {camera, camera};
  calibration.cameras[1].T_BC.translation().y() = -kBaseline;
  return calibration;
}

/// Your front end stands here.
class FrontEnd {
 public:
  explicit FrontEnd(const ear::Calibration& calibration) : calibration_(calibration) {
    std::uniform_real_distribution<double> direction(-M_PI, M_PI);
    std::uniform_real_distribution<double> distance(4.0, 6.0);
    std::uniform_real_distribution<double> height(-1.5, 1.5);
    for (int i = 0; i < 400; ++i) {  // on the walls of a round room about the circle's centre
      const double angle = direction(random_);
      const double away = distance(random_);
      points_W_.emplace_back(away * std::cos(angle), kRadius + away * std::sin(angle), height(random_));
    }
    ids_.resize(points_W_.size());
  }

  ear::FeatureFrame process(ear::TimeNs t_ns) {
    const Eigen::Isometry3d T_BW = truth_at(1e-9 * static_cast<double>(t_ns)).T_WB.inverse();
    ear::FeatureFrame frame;
    frame.t_ns = t_ns;
    for (std::size_t i = 0; i < points_W_.size(); ++i) {
      const std::optional<Eigen::Vector2d> left = project(0, T_BW * points_W_[i]);
      if (!left) {
        ids_[i] = 0;  // lost; if it is seen again it is another feature
        continue;
      }
      if (ids_[i] == 0) ids_[i] = ++last_id_;
      ear::FeatureObservation feature;
      feature.id = ids_[i];
      feature.left = *left;
      if (const std::optional<Eigen::Vector2d> right = project(1, T_BW * points_W_[i])) {
        feature.right = *right;
        feature.has_right = true;
      }
      frame.features.push_back(feature);
    }
    return frame;
  }

 private:
  /// In normalized coordinates, as an image with noise would give it; nothing outside the image.
  std::optional<Eigen::Vector2d> project(std::size_t camera, const Eigen::Vector3d& point_B) {
    const ear::CameraCalibration& c = calibration_.cameras[camera];
    const Eigen::Vector3d point_C = c.T_BC.inverse() * point_B;
    if (point_C.z() < 0.3) return std::nullopt;
    const Eigen::Vector2d seen = point_C.head<2>() / point_C.z() + Eigen::Vector2d(noise_(random_), noise_(random_));
    if (std::abs(seen.x()) > 0.5 * c.width / c.fu || std::abs(seen.y()) > 0.5 * c.height / c.fv) return std::nullopt;
    return seen;
  }

  ear::Calibration calibration_;
  std::mt19937_64 random_{1};
  std::normal_distribution<double> noise_{0.0, kNoisePx / kFocal};
  std::vector<Eigen::Vector3d> points_W_;
  std::vector<std::uint64_t> ids_;  // of each point; 0: not tracked
  std::uint64_t last_id_ = 0;
};

}  // namespace

int main() {
  const ear::Calibration calibration = describe_vehicle();
  ear::Filter filter(ear::FilterConfig{}, calibration);
  FrontEnd front_end(calibration);

  double error = 1e9;
  const int samples = static_cast<int>(1e9 * kDuration / static_cast<double>(kImuPeriod));
  for (int i = 0; i <= samples; ++i) {
    const ear::TimeNs t_ns = i * kImuPeriod;
    filter.add_imu(imu_at(t_ns));
    if (i % kImuPerFrame != 0) continue;
    const std::optional<ear::Estimate> estimate = filter.process(front_end.process(t_ns));
    if (!estimate) continue;  // it has to stand for half a second first
    const ear::NavState& state = estimate->state;
    const Eigen::Vector3d true_p_WB = truth_at(1e-9 * static_cast<double>(state.t_ns)).T_WB.translation();
    error = (state.p_WB - true_p_WB).norm();
    if (i % kImuPerPrint == 0) {
      std::printf("%4.1f s: %6.3f %6.3f %6.3f m, %.3f m off, %d features\n", 1e-9 * static_cast<double>(state.t_ns),
                  state.p_WB.x(), state.p_WB.y(), state.p_WB.z(), error, estimate->frame.tracks);
    }
  }
  return error < kTolerance ? EXIT_SUCCESS : EXIT_FAILURE;
}
