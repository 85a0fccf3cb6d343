// Lenses and feature tracks: back and forth, noise, persistence, visibility.
#include <doctest/doctest.h>

#include <Eigen/Geometry>
#include <cmath>
#include <map>
#include <random>
#include <set>
#include <vector>

#include "tests/support/about.h"
#include "tools/simulator/constants.h"
#include "tools/simulator/lens.h"
#include "tools/simulator/simulation.h"
#include "tools/simulator/vehicle.h"

namespace ear::simulator {
namespace {

using test::about;

Eigen::Isometry3d pose_WC(const Truth& truth, const ear::CameraCalibration& camera) {
  Eigen::Isometry3d T_WB = Eigen::Isometry3d::Identity();
  T_WB.linear() = truth.R_WB;
  T_WB.translation() = truth.p_WB;
  return T_WB * camera.T_BC;
}

// All rays on which one feature was seen.
struct Track {
  std::vector<Eigen::Vector3d> origins, directions;
};

// The point nearest to all rays of a track: least squares over the perpendicular distances.
Eigen::Vector3d intersect(const Track& track) {
  Eigen::Matrix3d A = Eigen::Matrix3d::Zero();
  Eigen::Vector3d b = Eigen::Vector3d::Zero();
  for (std::size_t i = 0; i < track.origins.size(); ++i) {
    const Eigen::Vector3d d = track.directions[i].normalized();
    const Eigen::Matrix3d across = Eigen::Matrix3d::Identity() - d * d.transpose();
    A += across;
    b += across * track.origins[i];
  }
  return A.ldlt().solve(b);
}

}  // namespace

TEST_CASE("lens: rays come back from their pixels, all over the picture") {
  for (const ear::LensModel lens : {ear::LensModel::radial_tangential, ear::LensModel::equidistant}) {
    for (const ear::CameraCalibration& camera : make_vehicle(30.0, lens).cameras) {
      for (double u = 0.0; u < 640.0; u += 71.0) {
        for (double v = 0.0; v < 480.0; v += 53.0) {
          const Eigen::Vector2d ray = to_ray(camera, {u, v});
          CHECK((to_pixel(camera, ray) - Eigen::Vector2d(u, v)).norm() < 1e-9);
        }
      }
    }
  }
}

TEST_CASE("lens: the models by their formulas") {
  ear::CameraCalibration camera;
  camera.fu = 400.0;
  camera.fv = 410.0;
  camera.cu = 320.0;
  camera.cv = 240.0;
  camera.distortion = {0.1, 0.01, 0.001, 0.002};
  // x = 0.5, y = -0.25: r2 = 0.3125, radial = 1.032226..., worked out by hand.
  const double radial = 1.0 + 0.1 * 0.3125 + 0.01 * 0.3125 * 0.3125;
  const double x = 0.5 * radial + 2.0 * 0.001 * 0.5 * -0.25 + 0.002 * (0.3125 + 2.0 * 0.25);
  const double y = -0.25 * radial + 0.001 * (0.3125 + 2.0 * 0.0625) + 2.0 * 0.002 * 0.5 * -0.25;
  CHECK((to_pixel(camera, {0.5, -0.25}) - Eigen::Vector2d(400.0 * x + 320.0, 410.0 * y + 240.0)).norm() < 1e-9);

  camera.distortion = {0.0, 0.0, 0.0, 0.0, 0.5};  // k3 alone: r2^3 = 0.030517578125
  CHECK((to_pixel(camera, {0.5, -0.25}) - (1.0 + 0.5 * 0.030517578125) * Eigen::Vector2d(400.0 * 0.5, 410.0 * -0.25) -
         Eigen::Vector2d(320.0, 240.0))
            .norm() < 1e-9);

  camera.lens = ear::LensModel::equidistant;
  camera.distortion = {0.0, 0.0, 0.0, 0.0};
  // 45 degrees to the right: the pixel is f * pi / 4 away.
  CHECK((to_pixel(camera, {1.0, 0.0}) - Eigen::Vector2d(400.0 * kPi / 4.0 + 320.0, 240.0)).norm() < 1e-9);
}

TEST_CASE("tracks: rays of one id meet in one point, and the noise is what was asked for") {
  Options options;
  options.sequence = "fly1";
  options.seed = 21;
  options.duration = 20.0;
  options.track.sigma_px = 0.5;
  const Simulation simulation(options);
  const auto& cameras = simulation.true_calibration().cameras;

  // The truth of each point from a run without noise: the same draws, so the same ids.
  options.track.sigma_px = 0.0;
  const Simulation exact(options);
  double worst = 0.0;
  std::map<std::uint64_t, Track> rays;
  for (std::size_t i = 0; i < exact.frame_times().size(); ++i) {
    const Truth truth = exact.truth(exact.frame_times()[i]);
    for (const ear::FeatureObservation& seen : exact.tracks(i).features) {
      for (std::size_t camera = 0; camera < (seen.has_right ? 2U : 1U); ++camera) {
        const Eigen::Isometry3d T_WC = pose_WC(truth, cameras[camera]);
        const Eigen::Vector2d ray = camera == 0 ? seen.left : seen.right;
        rays[seen.id].origins.emplace_back(T_WC.translation());
        rays[seen.id].directions.emplace_back((T_WC.linear() * ray.homogeneous()).normalized());
      }
    }
  }
  for (const auto& [id, track] : rays) {
    if (track.origins.size() < 4) continue;
    const Eigen::Vector3d p_W = intersect(track);
    for (std::size_t i = 0; i < track.origins.size(); ++i) {
      const Eigen::Vector3d along = p_W - track.origins[i];
      worst = std::max(worst, track.directions[i].cross(along).norm() / along.norm());
    }
  }
  CHECK(worst < 1e-6);

  double sum = 0.0;
  double n = 0.0;
  for (std::size_t i = 0; i < exact.frame_times().size(); i += 5) {
    const auto& noisy_features = simulation.tracks(i).features;
    const auto& exact_features = exact.tracks(i).features;
    REQUIRE(noisy_features.size() == exact_features.size());
    for (std::size_t k = 0; k < noisy_features.size(); ++k) {
      REQUIRE(noisy_features[k].id == exact_features[k].id);
      sum +=
          (to_pixel(cameras[0], noisy_features[k].left) - to_pixel(cameras[0], exact_features[k].left)).squaredNorm();
      n += 2.0;
      if (!noisy_features[k].has_right) continue;
      sum +=
          (to_pixel(cameras[1], noisy_features[k].right) - to_pixel(cameras[1], exact_features[k].right)).squaredNorm();
      n += 2.0;
    }
  }
  CHECK(std::sqrt(sum / n) == about(0.5, 4.0 / std::sqrt(2.0 * n)));
}

TEST_CASE("tracks: as many as asked, spread over the picture, ids never come back") {
  Options options;
  options.seed = 22;
  options.duration = 25.0;
  const Simulation simulation(options);
  const ear::CameraCalibration& left = simulation.true_calibration().cameras[0];
  std::map<std::uint64_t, std::size_t> last_seen;
  std::map<std::uint64_t, int> length;
  double both = 0.0;
  double all = 0.0;
  for (std::size_t i = 0; i < simulation.frame_times().size(); ++i) {
    const ear::FeatureFrame& frame = simulation.tracks(i);
    CHECK(frame.t_ns == simulation.frame_times()[i]);
    CHECK(frame.features.size() == 150);
    std::set<int> quarters;
    for (const ear::FeatureObservation& seen : frame.features) {
      if (last_seen.count(seen.id) != 0) CHECK(last_seen[seen.id] + 1 == i);
      last_seen[seen.id] = i;
      ++length[seen.id];
      const Eigen::Vector2d pixel = to_pixel(left, seen.left);
      quarters.insert((pixel.x() < 320.0 ? 0 : 1) + (pixel.y() < 240.0 ? 0 : 2));
      all += 1.0;
      both += seen.has_right ? 1.0 : 0.0;
    }
    CHECK(quarters.size() == 4);
  }
  CHECK(both / all > 0.9);
  CHECK(both / all < 1.0);
  double frames = 0.0;
  for (const auto& [id, n] : length) frames += n;
  const double mean_life = frames / static_cast<double>(length.size()) / 30.0;
  CHECK(mean_life > 0.8);
  CHECK(mean_life < 4.5);
}

TEST_CASE("tracks: a standing camera loses tracks at the rate of their mean life") {
  Options options;
  options.sequence = "static";
  options.seed = 23;
  options.duration = 30.0;
  options.track.mean_life = 3.0;
  const Simulation simulation(options);
  double kept = 0.0;
  double before = 0.0;
  std::set<std::uint64_t> previous;
  for (std::size_t i = 0; i < simulation.frame_times().size(); ++i) {
    std::set<std::uint64_t> now;
    for (const ear::FeatureObservation& seen : simulation.tracks(i).features) now.insert(seen.id);
    for (const std::uint64_t id : previous) kept += now.count(id) != 0 ? 1.0 : 0.0;
    before += static_cast<double>(previous.size());
    previous = now;
  }
  const double lost = 1.0 - kept / before;
  const double expected = 1.0 - std::exp(-1.0 / 30.0 / 3.0);
  CHECK(lost == about(expected, 4.0 / std::sqrt(before * expected)));
}

TEST_CASE("tracks: no feature lies behind furniture") {
  Scene scene = make_room(Terrain());
  const Eigen::Vector3d eye_W(6.0, 4.85, 0.5);
  // The pillar at x = 1.9 to 2.6 hides the wall behind it, at any height; beside it the wall is seen.
  CHECK_FALSE(scene.sees(eye_W, {0.0, 5.05, 1.0}));
  CHECK_FALSE(scene.sees(eye_W, {0.0, 5.05, 3.0}));
  CHECK(scene.sees(eye_W, {0.0, 6.9, 1.0}));
  const auto hit = scene.cast(eye_W, -Eigen::Vector3d::UnitX());
  REQUIRE(hit);
  CHECK(hit->range == doctest::Approx(6.0 - 2.6));
  CHECK(scene.panels[static_cast<std::size_t>(hit->panel)].material == Material::concrete);
}

TEST_CASE("tracks: nothing is seen once the lenses are covered") {
  Options options;
  options.sequence = "occlusion1";
  options.seed = 24;
  options.duration = 6.0;
  const Simulation simulation(options);
  for (std::size_t i = 0; i < simulation.frame_times().size(); ++i) {
    const double t = static_cast<double>(simulation.frame_times()[i] - simulation.frame_times()[0]) * 1e-9;
    if (t < 2.0) CHECK(simulation.tracks(i).features.size() == 150);
    if (t > 2.5) CHECK(simulation.tracks(i).features.empty());
  }
}

TEST_CASE("tracks: outdoors there are enough, few of them near; blades of grass end some") {
  Options options;
  options.sequence = "lawn";
  options.seed = 25;
  options.duration = 12.0;
  const Simulation simulation(options);
  const Obstruction& obstruction = simulation.obstruction();
  double passing = 0.0;
  double hidden = 0.0;
  for (std::size_t i = 0; i < simulation.frame_times().size(); ++i) {
    const ear::FeatureFrame& frame = simulation.tracks(i);
    CHECK(frame.features.size() > 60);
    const double t = static_cast<double>(frame.t_ns - 1'600'000'000'000'000'000) * 1e-9;
    if (!obstruction.active(t)) continue;
    passing += 1.0;
    for (const ear::FeatureObservation& seen : frame.features) {
      // Half of the noise of 0.5 px may put a track next to a blade on it.
      hidden += obstruction.veil(0, t, seen.left).opacity > 0.8 ? 1.0 : 0.0;
    }
  }
  CHECK(passing > 10.0);
  CHECK(hidden / passing < 1.0);
}

TEST_CASE("obstruction: a blade is where it is in both pictures, and passes") {
  Hindrance hindrance;
  hindrance.tufts = 0.5;
  Rng rng = make_rng(3, Stream::obstruction);
  const Obstruction grass(hindrance, 60.0, rng);
  double frames = 0.0;
  double passing = 0.0;
  double veiled = 0.0;
  double rays = 0.0;
  for (double t = 0.0; t < 60.0; t += 0.1) {
    frames += 1.0;
    if (!grass.active(t)) {
      CHECK(grass.veil(0, t, {0.1, 0.3}).opacity == 0.0);
      continue;
    }
    passing += 1.0;
    for (double x = -0.8; x < 0.8; x += 0.05) {
      for (double y = -0.6; y < 0.6; y += 0.1) {
        rays += 1.0;
        veiled += grass.veil(0, t, {x, y}).opacity > 0.5 ? 1.0 : 0.0;
      }
    }
  }
  CHECK(passing / frames > 0.1);
  CHECK(passing / frames < 0.4);
  CHECK(veiled / rays > 0.02);
  CHECK(veiled / rays < 0.4);
}

}  // namespace ear::simulator
