// The estimates of the filter and of the whole pipeline on two short motions that are made here, one line of numbers
// each: what one processor makes of them is compared with what another does (compare_estimates.py).
//
// No simulator, no file: for a processor that is emulated it has to be quick.
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <optional>
#include <random>
#include <vector>

#include "filter/filter.h"
#include "frontend/frontend.h"
#include "tests/frontend/scene.h"

namespace ear {
namespace {

constexpr TimeNs kImuPeriod = 5'000'000;
constexpr int kImuPerFrame = 10;
constexpr double kGravity = 9.81;
constexpr double kStanding = 1.0;  // [s] before it moves

double seconds(TimeNs t_ns) { return 1e-9 * static_cast<double>(t_ns); }

void print(const char* part, const Estimate& estimate) {
  const NavState& x = estimate.state;
  std::printf("%s %.3f %d", part, seconds(x.t_ns), estimate.frame.tracks);
  for (const double value : {x.p_WB.x(), x.p_WB.y(), x.p_WB.z(), x.v_W.x(), x.v_W.y(), x.v_W.z(), x.q_WB.w(),
                             x.q_WB.x(), x.q_WB.y(), x.q_WB.z()}) {
    std::printf(" %.12g", value);
  }
  for (int i = 0; i < estimate_error::size; ++i) std::printf(" %.12g", std::sqrt(estimate.covariance(i, i)));
  std::printf("\n");
}

/// On wheels along a circle on flat ground, past points around it; lasers look at the ground. Nothing is rendered.
class Circle {
 public:
  void run() {
    Filter filter(FilterConfig{}, calibration_);
    for (TimeNs t_ns = 0; seconds(t_ns) <= kDuration; t_ns += kImuPeriod) {
      const auto tick = static_cast<int>(t_ns / kImuPeriod);
      filter.add_imu(imu(t_ns));
      if (tick % 2 == 0) filter.add_encoder(encoder(t_ns));
      if (tick % 4 == 0) filter.add_laser(laser(t_ns));
      if (tick % kImuPerFrame != 0) continue;
      if (const std::optional<Estimate> estimate = filter.process(frame(t_ns))) print("filter", *estimate);
    }
  }

  Circle() : calibration_(describe()) {
    std::uniform_real_distribution<double> unit(-1.0, 1.0);
    for (int i = 0; i < 400; ++i) {  // on the walls of a round room
      const double angle = M_PI * unit(random_);
      const double away = 5.0 + unit(random_);
      points_W_.emplace_back(away * std::cos(angle), kRadius + away * std::sin(angle), 1.5 * unit(random_));
    }
    ids_.resize(points_W_.size());
  }

 private:
  static constexpr double kDuration = 12.0;  // [s]
  static constexpr double kRadius = 2.0;     // [m]
  static constexpr double kSpeed = 0.8;      // [m/s], reached in one second
  static constexpr double kHeight = 0.2;     // of the body above the ground [m]
  static constexpr double kNoise = 0.5 / 400.0;

  static Calibration describe() {
    CameraCalibration camera;
    camera.T_BC.linear() << 0, 0, 1, -1, 0, 0, 0, -1, 0;
    camera.width = 640;
    camera.height = 480;
    camera.fu = camera.fv = 400.0;
    camera.cu = 319.5;
    camera.cv = 239.5;
    Calibration calibration;
    calibration.cameras = {camera, camera};
    calibration.cameras[1].T_BC.translation().y() = -0.1;
    calibration.encoder.emplace();
    calibration.encoder->wraps = false;
    calibration.encoder->T_BO.translation().z() = calibration.encoder->wheel_radius[0] - kHeight;
    calibration.lasers.emplace();
    for (const Eigen::Vector2d& tilt :
         {Eigen::Vector2d(0.5, 0.0), Eigen::Vector2d(-0.3, 0.4), Eigen::Vector2d(-0.3, -0.4)})
      calibration.lasers->beams.push_back(
          {"", Eigen::Vector3d::Zero(), Eigen::Vector3d(tilt.x(), tilt.y(), -1.0).normalized()});
    return calibration;
  }

  [[nodiscard]] static double speed(double t) { return kSpeed * std::clamp(t - kStanding, 0.0, 1.0); }
  [[nodiscard]] static double distance(double t) {
    const double driving = std::max(0.0, t - kStanding);
    const double ramp = std::min(driving, 1.0);
    return kSpeed * (0.5 * ramp * ramp + driving - ramp);
  }

  [[nodiscard]] static ImuSample imu(TimeNs t_ns) {
    const double t = seconds(t_ns);
    const double along = t > kStanding && t < kStanding + 1.0 ? kSpeed : 0.0;
    const double v = speed(t);
    return {t_ns, {0.0, 0.0, v / kRadius}, {along, v * v / kRadius, kGravity}};
  }

  [[nodiscard]] EncoderSample encoder(TimeNs t_ns) const {
    const EncoderCalibration& axle = *calibration_.encoder;
    const auto count = [&](double offset, double radius) {
      const double way = distance(seconds(t_ns)) * (1.0 - offset / kRadius);
      return static_cast<std::int64_t>(
          std::llround(way / (2.0 * M_PI * radius) * static_cast<double>(axle.resolution)));
    };
    const double half = 0.5 * axle.track_width;  // it turns to the left: the left wheel's way is the shorter one
    return {t_ns, count(half, axle.wheel_radius[0]), count(-half, axle.wheel_radius[1])};
  }

  [[nodiscard]] LaserSample laser(TimeNs t_ns) const {
    LaserSample sample;
    sample.t_ns = t_ns;
    for (const LaserBeam& beam : calibration_.lasers->beams) sample.range.push_back(-kHeight / beam.d_B.z());
    return sample;
  }

  FeatureFrame frame(TimeNs t_ns) {
    const double yaw = distance(seconds(t_ns)) / kRadius;
    const Eigen::Isometry3d T_WB = Eigen::Translation3d(kRadius * std::sin(yaw), kRadius * (1.0 - std::cos(yaw)), 0.0) *
                                   Eigen::AngleAxisd(yaw, Eigen::Vector3d::UnitZ());
    FeatureFrame frame;
    frame.t_ns = t_ns;
    for (std::size_t i = 0; i < points_W_.size(); ++i) {
      FeatureObservation feature;
      const std::optional<Eigen::Vector2d> left = project(0, T_WB.inverse() * points_W_[i]);
      if (!left) {
        ids_[i] = 0;  // lost; if it is seen again it is another feature
        continue;
      }
      if (ids_[i] == 0) ids_[i] = ++last_id_;
      feature.id = ids_[i];
      feature.left = *left;
      if (const std::optional<Eigen::Vector2d> right = project(1, T_WB.inverse() * points_W_[i])) {
        feature.right = *right;
        feature.has_right = true;
      }
      frame.features.push_back(feature);
    }
    return frame;
  }

  /// In normalized coordinates, with noise; nothing outside the image.
  std::optional<Eigen::Vector2d> project(std::size_t camera, const Eigen::Vector3d& point_B) {
    const Eigen::Vector3d point_C = calibration_.cameras[camera].T_BC.inverse() * point_B;
    if (point_C.z() < 0.3) return std::nullopt;
    std::uniform_real_distribution<double> noise(-kNoise, kNoise);
    Eigen::Vector2d seen = point_C.head<2>() / point_C.z();
    for (double& coordinate : seen) coordinate += noise(random_);  // one after the other, on every processor
    if (std::abs(seen.x()) > 0.8 || std::abs(seen.y()) > 0.6) return std::nullopt;
    return seen;
  }

  Calibration calibration_;
  std::mt19937_64 random_{1};
  std::vector<Eigen::Vector3d> points_W_;
  std::vector<std::uint64_t> ids_;  // of each point; 0: not tracked
  std::uint64_t last_id_ = 0;
};

/// Hand-held before a wall, swinging sideways: images through front end and filter.
void swing() {
  constexpr double kDuration = 4.0;  // [s]
  constexpr double kWay = 0.1;       // [m] amplitude
  constexpr double kRate = 3.0;      // [rad/s]
  Calibration calibration;
  calibration.cameras = test_stereo_pair();
  // The scene has y down, the estimator's world z up: its samples are those of a body that looks along z, y down.
  Filter filter(FilterConfig{}, calibration);
  Frontend frontend(FrontendConfig{}, calibration.cameras);
  const std::vector<Camera> cameras(calibration.cameras.begin(), calibration.cameras.end());
  const std::vector<TexturedRectangle> scene{wall(1.0, 5)};
  for (TimeNs t_ns = 0; seconds(t_ns) <= kDuration; t_ns += kImuPeriod) {
    const double phase = kRate * std::max(0.0, seconds(t_ns) - kStanding);
    const double acceleration = seconds(t_ns) > kStanding ? kWay * kRate * kRate * std::cos(phase) : 0.0;
    filter.add_imu({t_ns, Eigen::Vector3d::Zero(), {acceleration, -kGravity, 0.0}});
    if (t_ns / kImuPeriod % kImuPerFrame != 0) continue;
    Eigen::Isometry3d T_WB = Eigen::Isometry3d::Identity();
    T_WB.translation().x() = kWay * (1.0 - std::cos(phase));
    const cv::Mat left = cameras[0].render(T_WB, scene);
    const cv::Mat right = cameras[1].render(T_WB, scene);
    MotionPrediction prediction;
    if (const std::optional<RelativeMotion> motion = filter.motion_to(t_ns)) {
      prediction = {motion->R_B1B0, motion->p_B0B1, motion->rotation_known, motion->translation_known};
    }
    const FeatureFrame& frame = frontend.process({t_ns, view_of(left), view_of(right)}, prediction);
    if (const std::optional<Estimate> estimate = filter.process(frame)) print("pipeline", *estimate);
  }
}

}  // namespace
}  // namespace ear

int main() {
  ear::Circle().run();
  ear::swing();
}
