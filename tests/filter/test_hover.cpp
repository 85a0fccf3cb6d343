// A drone that hovers while its rotors shake the gyroscope: what turns by nothing but noise shows nothing of the
// gyroscope's scale and of the camera's clock, however long it lasts.
#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <optional>
#include <random>
#include <vector>

#include "filter/ekf/so3.h"
#include "filter/filter.h"
#include "tests/support/hand_made_drive.h"
#include "tests/support/random_state.h"

using namespace ear;
using namespace ear::test;

namespace {

constexpr double kImuStep = 5e-3;  // [s]
constexpr int kSamplesPerFrame = 7;
constexpr double kStands = 3.0;      // [s] before it takes off
constexpr double kFocal = 385.0;     // [px]
constexpr double kTrackNoise = 0.5;  // [px]
constexpr double kShaken = 5.0;      // times the stated noise of the inertial samples

Calibration two_cameras() {
  Calibration calibration;
  calibration.imu.gyro_noise = 1e-3;
  calibration.imu.accel_noise = 1e-2;
  for (const double left : {0.025, -0.025}) {
    CameraCalibration& camera = calibration.cameras.emplace_back();
    camera.width = 640;
    camera.height = 480;
    camera.fu = camera.fv = kFocal;
    camera.cu = 319.5;
    camera.cv = 239.5;
    camera.rate_hz = 1.0 / (kSamplesPerFrame * kImuStep);
    camera.T_BC.linear() << 0, 0, 1, -1, 0, 0, 0, -1, 0;
    camera.T_BC.translation() = Eigen::Vector3d(0.1, left, 0.0);
  }
  return calibration;
}

/// Sways by 0.2 m and 10 mrad, slowly; from `turns_at` on it turns left by two revolutions in 20 s.
struct Hover {
  double turns_at = 0.0;  // [s]

  static double airborne(double t) { return t < kStands ? 0.0 : 1.0 - std::exp(-std::pow(t - kStands, 2)); }
  [[nodiscard]] double yaw(double t) const {
    const double part = std::min(1.0, std::max(0.0, t - turns_at) / 20.0);
    return 4.0 * M_PI * part - 2.0 * std::sin(2.0 * M_PI * part);
  }
  [[nodiscard]] Eigen::Matrix3d R_WB(double t) const {
    const Eigen::Vector3d sway(std::sin(1.3 * t), std::sin(0.9 * t), std::sin(0.5 * t));
    return exp_so3({0.0, 0.0, yaw(t)}) * exp_so3(0.01 * airborne(t) * sway);
  }
  static Eigen::Vector3d p_WB(double t) {
    return airborne(t) * Eigen::Vector3d(0.2 * std::sin(0.4 * t), 0.2 * std::sin(0.3 * t), 0.1 * std::sin(0.5 * t));
  }
  [[nodiscard]] Eigen::Vector3d gyro_B(double t) const {
    return rate_of([this](double moment) { return R_WB(moment); }, t);
  }
  [[nodiscard]] Eigen::Vector3d accel_B(double t) const {
    constexpr double h = 2e-3;
    const Eigen::Vector3d a_W = (p_WB(t + h) - 2.0 * p_WB(t) + p_WB(t - h)) / (h * h);
    return R_WB(t).transpose() * (a_W + Eigen::Vector3d(0.0, 0.0, 9.81));
  }
};

/// Points all around, each seen for a second or so under one number.
class Scene {
 public:
  explicit Scene(std::mt19937_64& rng) : rng_(rng) {
    for (int i = 0; i < 700; ++i) {
      Eigen::Vector3d direction = random_vector(rng_, 1.0);
      direction.z() *= 0.6;
      points_.emplace_back((3.0 + 2.0 * uniform_(rng_)) * direction.normalized());
    }
  }

  FeatureFrame seen(double t, const Hover& truth, const Calibration& calibration) {
    FeatureFrame frame;
    frame.t_ns = stamp(t);
    const Eigen::Matrix3d R_BW = truth.R_WB(t).transpose();
    std::map<std::size_t, std::uint64_t> going_on;
    for (std::size_t i = 0; i < points_.size() && frame.features.size() < 150; ++i) {
      const Eigen::Vector3d p_B = R_BW * (points_[i] - Hover::p_WB(t));
      FeatureObservation feature;
      feature.has_right = true;
      if (!project(p_B, calibration.cameras[0], feature.left) || !project(p_B, calibration.cameras[1], feature.right))
        continue;
      const auto known = ids_.find(i);
      feature.id = known == ids_.end() || uniform_(rng_) > 0.96 ? next_id_++ : known->second;
      going_on[i] = feature.id;
      frame.features.push_back(feature);
    }
    ids_.swap(going_on);
    return frame;
  }

 private:
  bool project(const Eigen::Vector3d& p_B, const CameraCalibration& camera, Eigen::Vector2d& seen) {
    const Eigen::Vector3d p_C = camera.T_BC.inverse() * p_B;
    if (p_C.z() < 0.3) return false;
    seen = p_C.head<2>() / p_C.z();
    if (std::abs(seen.x()) > 0.8 || std::abs(seen.y()) > 0.6) return false;
    seen += random_vector(rng_, kTrackNoise / kFocal).head<2>();
    return true;
  }

  std::mt19937_64& rng_;
  std::uniform_real_distribution<double> uniform_{0.0, 1.0};
  std::vector<Eigen::Vector3d> points_;
  std::map<std::size_t, std::uint64_t> ids_;
  std::uint64_t next_id_ = 1;
};

struct Learned {
  double scale = 0.0;        // the largest error of the gyroscope's scales
  double sigma = 0.0;        // of that about the vertical
  double time_offset = 0.0;  // [s]
};

/// All else is as the calibration says.
Learned hover(double turns_at, double duration, std::uint64_t seed) {
  std::mt19937_64 rng{seed};
  const Calibration calibration = two_cameras();
  Filter filter({}, calibration);
  const Hover truth{turns_at};
  Scene scene(rng);
  const Eigen::Vector3d b_g = random_vector(rng, 2e-3), b_a = random_vector(rng, 0.03);
  std::optional<FeatureFrame> waiting;  // for the first sample after it
  for (int k = 0; k * kImuStep < duration; ++k) {
    const double t = k * kImuStep;
    const double shaken = (t < kStands ? 1.0 : kShaken) / std::sqrt(kImuStep);
    filter.add_imu({stamp(t), truth.gyro_B(t) + b_g + random_vector(rng, shaken * calibration.imu.gyro_noise),
                    truth.accel_B(t) + b_a + random_vector(rng, shaken * calibration.imu.accel_noise)});
    if (k % kSamplesPerFrame != 0) continue;
    if (waiting) filter.process(*waiting);
    waiting = scene.seen(t, truth, calibration);
  }
  REQUIRE(filter.ekf().running());
  const State& x = filter.ekf().state();
  const auto variance = filter.ekf().covariance().matrix().diagonal();
  Learned learned;
  learned.scale = (x.imu.gyro_matrix.diagonal() - Eigen::Vector3d::Ones()).cwiseAbs().maxCoeff();
  learned.time_offset = x.camera.time_offset;
  learned.sigma = std::sqrt(variance(err::gyro_matrix + 8));
  return learned;
}

}  // namespace

TEST_CASE("hover: a gyroscope that is shaken stays as exact as it was") {
  const PriorConfig prior;
  for (const std::uint64_t seed : {1U, 3U}) {
    CAPTURE(seed);
    const Learned learned = hover(1e9, 40.0, seed);
    CHECK(learned.scale < 0.2 * prior.gyro_scale);
    CHECK(learned.sigma > 0.99 * prior.gyro_scale);
    CHECK(std::abs(learned.time_offset) < 0.5 * prior.time_offset);
  }
}

TEST_CASE("hover: a turn shows its scale") {
  const PriorConfig prior;
  const Learned learned = hover(6.0, 28.0, 1);
  CHECK(learned.sigma < 0.6 * prior.gyro_scale);
  CHECK(learned.scale < 3.0 * learned.sigma);
}
