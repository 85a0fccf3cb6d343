// One camera, which is its own second camera where it was at an earlier clone.
#include "filter/sources/cameras/earlier_views.h"

#include <doctest/doctest.h>

#include <random>

#include "filter/ekf/so3.h"
#include "filter/sources/cameras/stereo_motion.h"
#include "tests/support/random_state.h"

using namespace ear;
using namespace ear::test;

namespace {

constexpr double kSigma = 0.5 / 385.0;

/// A body that goes to the left, seen by one camera that looks along its x; points 2 to 6 m ahead.
class Scene {
 public:
  explicit Scene(unsigned seed) {
    std::mt19937_64 rng{seed};
    x.camera = random_cameras(rng);
    std::uniform_real_distribution<double> across(-1.5, 1.5), ahead(2.0, 6.0);
    for (int i = 0; i < 100; ++i) points_W_.emplace_back(ahead(rng), across(rng), across(rng));
  }

  static Pose body(double left) { return {exp_so3({0.0, 0.02 * left, -0.05 * left}), {0.0, left, 0.1 * left}}; }

  /// The features with ids from `first` on, in an order that is not that of their ids.
  [[nodiscard]] std::vector<FeatureObservation> look(const Pose& T_WB, std::uint64_t first = 0) const {
    const Pose T_CW = (T_WB * x.camera.T_BC0).inverse();
    std::vector<FeatureObservation> features;
    for (std::uint64_t id = points_W_.size(); id-- > first;) {
      const Eigen::Vector3d p_C = T_CW.R * points_W_[id] + T_CW.p;
      FeatureObservation feature;
      feature.id = id;
      feature.left = x.camera.lens_error[0].measured(p_C.hnormalized());
      features.push_back(feature);
    }
    return features;
  }

  void add_clone(double left, std::uint64_t first = 0) {
    Clone clone;
    clone.frame = x.clones.size();
    clone.T_WB = body(left);
    x.clones.push_back(clone);
    views.add(clone.frame, look(clone.T_WB, first));
  }

  State x;
  EarlierViews views{4};

 private:
  std::vector<Eigen::Vector3d> points_W_;
};

Covariance covariance_of(const State& x, double sigma) {
  Covariance P(x.error_size());
  P.reset(Eigen::VectorXd::Constant(x.error_size(), sigma));
  return P;
}

}  // namespace

TEST_CASE("earlier views: two views of one camera show the next motion as two cameras do") {
  Scene scene(51);
  scene.add_clone(0.0);
  scene.add_clone(0.3);
  REQUIRE(scene.views.find(scene.x, covariance_of(scene.x, 0.0), 0.1));
  CHECK(scene.views.features().features.size() == 100);
  FeatureFrame next;
  next.features = scene.look(Scene::body(0.4));
  StereoMatches matches;
  const CameraState& cameras = scene.views.cameras();
  const auto motion = stereo_motion(matches.find(scene.views.features(), next, cameras), cameras, Pose{}, kSigma);
  REQUIRE(motion);
  const Pose truth = Scene::body(0.3).inverse() * Scene::body(0.4);
  CHECK((motion->T_B0B1.p - truth.p).norm() < 1e-7);
  CHECK(log_so3(motion->T_B0B1.R.transpose() * truth.R).norm() < 1e-7);
}

TEST_CASE("earlier views: the one that shows a motion best is far away, and has many features in common") {
  Scene scene(52);
  scene.add_clone(0.0, 85);  // 15 features in common with those that come
  scene.add_clone(0.2);
  scene.add_clone(0.25);
  scene.add_clone(0.3);
  const Covariance P = covariance_of(scene.x, 0.0);
  const auto second_of = [&](double distance) {
    REQUIRE(scene.views.find(scene.x, P, distance));
    const Pose T_WC1 = Scene::body(0.3) * scene.x.camera.T_BC0 * scene.views.cameras().T_C0C1;
    for (std::size_t k = 0; k < 3; ++k) {
      if ((T_WC1.p - (scene.x.clones[k].T_WB * scene.x.camera.T_BC0).p).norm() < 1e-9) return static_cast<int>(k);
    }
    return -1;
  };
  CHECK(second_of(1e-3) == 1);  // farther than the last one, with as many features
  CHECK(second_of(0.1) == 1);
  CHECK(second_of(2.0) == 0);  // 15 depths that are nine times as good
}

TEST_CASE("earlier views: lengths are as uncertain as the way between both") {
  Scene scene(53);
  scene.add_clone(0.0);
  scene.add_clone(0.3);
  Covariance P = covariance_of(scene.x, 0.0);
  P.inflate(err::clone(0) + 3, Eigen::Matrix3d::Identity() * 0.03 * 0.03);  // the place of the first clone
  REQUIRE(scene.views.find(scene.x, P, 0.1));
  const double way = scene.views.cameras().T_C0C1.p.norm();
  CHECK(scene.views.scale_variance() == doctest::Approx(0.03 * 0.03 / (way * way)));
}

TEST_CASE("earlier views: too few features, a clone without a view and one that is forgotten show nothing") {
  Scene scene(54);
  scene.add_clone(0.0);
  const Covariance one = covariance_of(scene.x, 0.0);
  CHECK_FALSE(scene.views.find(scene.x, one, 0.1));
  scene.add_clone(0.3, 91);  // nine
  const Covariance P = covariance_of(scene.x, 0.0);
  CHECK_FALSE(scene.views.find(scene.x, P, 0.1));
  scene.views.forget(1);
  CHECK_FALSE(scene.views.find(scene.x, P, 0.1));  // the newest clone has no view
  scene.views.add(1, scene.look(Scene::body(0.3)));
  CHECK(scene.views.find(scene.x, P, 0.1));
  scene.views.forget(0);
  CHECK_FALSE(scene.views.find(scene.x, P, 0.1));
  scene.views.add(0, scene.look(Scene::body(0.0)));
  scene.views.clear();
  CHECK_FALSE(scene.views.find(scene.x, P, 0.1));
  CHECK_FALSE(scene.views.find(State{}, P, 0.1));
}
