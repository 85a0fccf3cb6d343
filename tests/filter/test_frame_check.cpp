#include <doctest/doctest.h>

#include <cmath>
#include <random>

#include "filter/ekf/ekf.h"
#include "filter/ekf/initial_state.h"
#include "filter/ekf/so3.h"
#include "filter/sources/cameras/cameras.h"
#include "filter/sources/cameras/frame_check.h"

using namespace ear;

namespace {

/// A rig whose right camera looks a little elsewhere; points at 1 to 8 m; noise of both coordinates in both cameras.
FeatureFrame look(const CameraState& cameras, int points, double sigma, std::uint64_t seed) {
  std::mt19937_64 rng(seed);
  std::normal_distribution<double> noise(0.0, sigma);
  std::uniform_real_distribution<double> across(-0.6, 0.6), depth(1.0, 8.0);
  FeatureFrame frame;
  for (int i = 0; i < points; ++i) {
    const double z = depth(rng);
    const Eigen::Vector3d p_C0 = {z * across(rng), z * across(rng), z};
    const Eigen::Vector3d p_C1 = cameras.T_C0C1.R.transpose() * (p_C0 - cameras.T_C0C1.p);
    FeatureObservation feature;
    feature.id = static_cast<std::uint64_t>(i);
    feature.left = p_C0.hnormalized() + Eigen::Vector2d(noise(rng), noise(rng));
    feature.right = p_C1.hnormalized() + Eigen::Vector2d(noise(rng), noise(rng));
    feature.has_right = true;
    frame.features.push_back(feature);
  }
  return frame;
}

CameraState make_rig() {
  CameraState cameras;
  cameras.T_C0C1.R = exp_so3({0.01, -0.02, 0.015});
  cameras.T_C0C1.p = {0.05, 0.002, -0.001};
  return cameras;
}

/// Standard deviation of one observation as it is measured, normalized; 0 where it is not.
double measured(const FeatureFrame& frame, const CameraState& cameras) {
  FrameCheck check(1e-6, 1.0);  // less than any noise
  check.measure_noise(frame, cameras);
  return check.noise() > 1.0 ? check.sigma() : 0.0;
}

}  // namespace

TEST_CASE("image noise: what is measured is what there is, in the mean over frames") {
  for (const double sigma : {1e-3, 4e-3}) {
    double sum = 0.0;
    for (std::uint64_t seed = 0; seed < 200; ++seed) {
      sum += measured(look(make_rig(), 100, sigma, seed), make_rig());
    }
    CHECK(std::abs(sum / 200.0 / sigma - 1.0) < 0.03);
  }
}

TEST_CASE("image noise: a calibration that is off in pitch by ten times the noise is no noise") {
  CameraState given = make_rig();
  given.T_C0C1.R = given.T_C0C1.R * exp_so3({0.01, 0.0, 0.0});
  CHECK(measured(look(make_rig(), 150, 1e-3, 1), given) < 2e-3);
}

TEST_CASE("image noise: a third of wrong matches does not make it twice as large, few features tell nothing") {
  FeatureFrame frame = look(make_rig(), 150, 1e-3, 2);
  for (std::size_t i = 0; i < 50; ++i) frame.features[3 * i].right.y() += 0.05 * (i % 2 == 0 ? 1.0 : -1.0);
  CHECK(measured(frame, make_rig()) < 2e-3);
  frame.features.resize(19);
  CHECK(measured(frame, make_rig()) == 0.0);
}

TEST_CASE("frame check: an image from before the start, or from before a restart, is compared with nothing") {
  Calibration calibration;
  calibration.cameras.resize(2);
  calibration.cameras[1].T_BC.translation().y() = -0.1;
  const FilterConfig config;
  Ekf ekf(config, calibration);
  Cameras cameras(config, calibration);
  const auto see = [&](TimeNs t_ns) {
    FeatureFrame frame = look(camera_state(calibration), 40, 1e-4, 5);
    frame.t_ns = t_ns;
    cameras.measure_noise(frame, ekf.state().camera);
    const int matches = ekf.running() ? cameras.compare(frame, ekf).matches : 0;
    cameras.remember(frame, ekf);
    return matches;
  };
  const auto start = [&](const Eigen::Vector3d& tilt) {
    ImuState x;
    x.R_WB = exp_so3(tilt);
    ekf.start(x, Eigen::VectorXd::Constant(err::clones, 0.1));
    ekf.clone(1.0);
  };
  see(0);
  CHECK_FALSE(cameras.image_pose(ekf.state()).has_value());
  start({0.3, 0.1, 0.0});
  CHECK(see(100'000'000) == 0);
  CHECK(see(200'000'000) == 40);
  ekf.reset();
  cameras.reset();
  start({0.0, -0.4, 0.0});
  CHECK(see(300'000'000) == 0);
  CHECK(see(400'000'000) == 40);
}
