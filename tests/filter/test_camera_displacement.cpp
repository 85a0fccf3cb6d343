#include "filter/sources/cameras/camera_displacement.h"

#include <doctest/doctest.h>

#include <Eigen/Cholesky>
#include <random>

#include "tests/support/random_state.h"

using namespace ear;
using namespace ear::test;

namespace {

constexpr double kSigma = 0.5 / 400.0;  // half a pixel

/// Points some metres ahead, seen by both cameras from a body at T_WB.
class Scene {
 public:
  Scene(std::mt19937_64& rng, const CameraState& camera, int count) : camera_(camera) {
    std::uniform_real_distribution<double> u(-0.6, 0.6), v(-0.4, 0.4), depth(0.7, 3.0);
    for (int i = 0; i < count; ++i) {
      const double z = depth(rng);
      points_W_.push_back(camera.T_BC0.R * (z * Eigen::Vector3d(u(rng), v(rng), 1.0)) + camera.T_BC0.p);
    }
  }

  FeatureFrame seen_from(const Pose& T_WB, std::mt19937_64& rng, double sigma) const {
    FeatureFrame frame;
    for (std::size_t i = points_W_.size(); i-- > 0;) {  // not in the order of the ids
      const Eigen::Vector3d p_B = T_WB.R.transpose() * (points_W_[i] - T_WB.p);
      const Eigen::Vector3d p_C0 = camera_.T_BC0.R.transpose() * (p_B - camera_.T_BC0.p);
      const Eigen::Vector3d p_C1 = camera_.T_C0C1.R.transpose() * (p_C0 - camera_.T_C0C1.p);
      FeatureObservation feature;
      feature.id = 100 + i;
      feature.left = p_C0.hnormalized() + random_vector(rng, sigma).head<2>();
      feature.right = p_C1.hnormalized() + random_vector(rng, sigma).head<2>();
      feature.has_right = true;
      frame.features.push_back(feature);
    }
    return frame;
  }

 private:
  CameraState camera_;
  std::vector<Eigen::Vector3d> points_W_;
};

const Pose kMove{exp_so3({0.01, -0.02, 0.05}), {0.06, -0.01, 0.004}};

}  // namespace

TEST_CASE("camera_displacement: a stereo point is where it is, and as uncertain as its covariance says") {
  std::mt19937_64 rng{81};
  const CameraState camera = random_cameras(rng);
  const Eigen::Vector3d p_C0(0.3, -0.2, 1.2);
  const Eigen::Vector3d p_C1 = camera.T_C0C1.R.transpose() * (p_C0 - camera.T_C0C1.p);
  FeatureObservation exact;
  exact.left = p_C0.hnormalized();
  exact.right = p_C1.hnormalized();
  exact.has_right = true;
  const StereoPoint point = stereo_point(camera, exact, kSigma);
  REQUIRE(point.usable);
  const Eigen::Vector3d p_BF = camera.T_BC0.R * p_C0 + camera.T_BC0.p;
  CHECK((point.p_BF - p_BF).norm() < 1e-9);

  constexpr int kRuns = 4000;
  const double sigma = 0.1 * kSigma;  // small enough to be linear
  const Eigen::LLT<Eigen::Matrix3d> llt(stereo_point(camera, exact, sigma).covariance);
  double chi_squared = 0.0;
  for (int run = 0; run < kRuns; ++run) {
    FeatureObservation noisy = exact;
    noisy.left += random_vector(rng, sigma).head<2>();
    noisy.right += random_vector(rng, sigma).head<2>();
    const Eigen::Vector3d e = stereo_point(camera, noisy, kSigma).p_BF - p_BF;
    chi_squared += e.dot(llt.solve(e)) / kRuns;
  }
  CHECK(chi_squared == doctest::Approx(3.0).epsilon(0.05));
}

TEST_CASE("camera_displacement: rays that do not meet, or meet behind or far away, make no point") {
  std::mt19937_64 rng{82};
  const CameraState camera = random_cameras(rng);
  const auto point = [&](const Eigen::Vector3d& p_C0, const Eigen::Vector2d& off) {
    FeatureObservation feature;
    feature.left = p_C0.hnormalized();
    feature.right = (camera.T_C0C1.R.transpose() * (p_C0 - camera.T_C0C1.p)).hnormalized() + off;
    feature.has_right = true;
    return stereo_point(camera, feature, kSigma).usable;
  };
  CHECK(point({0, 0, 1}, {0, 0}));
  CHECK_FALSE(point({0, 0, 1}, {0, 0.02}));
  CHECK_FALSE(point({0, 0, 1}, {0.2, 0}));
  CHECK_FALSE(point({0, 0, 20}, {0, 0}));
  CHECK_FALSE(stereo_point(camera, FeatureObservation{}, kSigma).usable);
}

TEST_CASE("camera_displacement: the motion is found, and as uncertain as its covariance says") {
  std::mt19937_64 rng{83};
  const CameraState camera = random_cameras(rng);
  const Scene scene(rng, camera, 60);
  const double rotation_sigma = 1e-3;
  constexpr int kRuns = 400;
  double chi_squared = 0.0;
  for (int run = 0; run < kRuns; ++run) {
    CameraDisplacement displacement(kSigma, 512);
    CHECK_FALSE(displacement.add(scene.seen_from(Pose{}, rng, kSigma), camera, kMove.R, 0.0).available);
    const Eigen::Matrix3d R = exp_so3(random_vector(rng, rotation_sigma)) * kMove.R;
    const Displacement z =
        displacement.add(scene.seen_from(kMove, rng, kSigma), camera, R, rotation_sigma * rotation_sigma);
    REQUIRE(z.available);
    const Eigen::Vector3d e = z.p_BiBj - kMove.p;
    chi_squared += e.dot(z.covariance.ldlt().solve(e)) / kRuns;
  }
  CHECK(chi_squared > 2.4);
  CHECK(chi_squared < 3.6);
}

TEST_CASE("camera_displacement: a quarter of the points may move on their own") {
  std::mt19937_64 rng{84};
  const CameraState camera = random_cameras(rng);
  const Scene scene(rng, camera, 80);
  CameraDisplacement displacement(kSigma, 512);
  displacement.add(scene.seen_from(Pose{}, rng, kSigma), camera, kMove.R, 0.0);
  FeatureFrame frame = scene.seen_from(kMove, rng, kSigma);
  for (std::size_t i = 0; i < 20; ++i) {
    frame.features[i].left.x() += 0.05;
    frame.features[i].right.x() += 0.05;
  }
  const Displacement z = displacement.add(frame, camera, kMove.R, 0.0);
  REQUIRE(z.available);
  const Eigen::Vector3d e = z.p_BiBj - kMove.p;
  CHECK(e.dot(z.covariance.ldlt().solve(e)) < 16.0);
}

TEST_CASE("camera_displacement: nothing without points that both frames show, or that agree") {
  std::mt19937_64 rng{85};
  const CameraState camera = random_cameras(rng);
  const Scene scene(rng, camera, 40);
  const FeatureFrame frame = scene.seen_from(Pose{}, rng, kSigma);
  CameraDisplacement displacement(kSigma, 512);
  const auto move = [&](const FeatureFrame& next) {
    displacement.clear();
    displacement.add(frame, camera, Eigen::Matrix3d::Identity(), 0.0);
    return displacement.add(next, camera, Eigen::Matrix3d::Identity(), 0.0);
  };
  CHECK(move(frame).available);
  FeatureFrame changed = frame;
  changed.features.resize(5);
  CHECK_FALSE(move(changed).available);
  CHECK_FALSE(move(changed).contradictory);
  changed = frame;
  for (FeatureObservation& feature : changed.features) feature.has_right = false;
  CHECK_FALSE(move(changed).available);
  changed = frame;
  for (FeatureObservation& feature : changed.features) feature.id += 1000;
  CHECK_FALSE(move(changed).available);
  changed = frame;
  for (FeatureObservation& feature : changed.features) {
    const Eigen::Vector3d jump = random_vector(rng, 0.1);
    feature.left += jump.head<2>();
    feature.right += jump.head<2>();
  }
  CHECK_FALSE(move(changed).available);
  CHECK(move(changed).contradictory);
}
