// The ground as the renderer sees it, against rays that are cast one by one, in double precision.
#include <doctest/doctest.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>
#include <string>

#include "tests/simulator/support.h"
#include "tools/simulator/ground_caster.h"
#include "tools/simulator/ground_view.h"
#include "tools/simulator/random.h"
#include "tools/simulator/rays.h"
#include "tools/simulator/sequence.h"
#include "tools/simulator/simulation.h"
#include "tools/simulator/tile.h"

namespace ear::simulator {
namespace {

constexpr double kFarthest = 30.0;  // [m]

struct Ray {
  Eigen::Vector3d eye_W, toward_W;  // the latter per metre of depth
};

// Height of a ray over the ground at some depth, as it appears in the picture [px]; negative inside the ground.
double gap_px(const Terrain& terrain, const Ray& ray, double focal, double depth) {
  const Eigen::Vector3d p_W = ray.eye_W + depth * ray.toward_W;
  return (p_W.z() - terrain.height(p_W.x(), p_W.y())) * focal / depth;
}

// How far from right it is that this ray meets the ground first at this depth [px]: it must be at the ground there, and
// must not have been below it before. An infinite depth says that it does not meet the ground within kFarthest.
double error_px(const Terrain& terrain, const Ray& ray, double focal, double depth) {
  const auto exact = terrain.cast(ray.eye_W, ray.toward_W.normalized(), kFarthest * ray.toward_W.norm());
  const double end = std::min(depth, kFarthest);
  double error = std::isfinite(depth) ? std::abs(gap_px(terrain, ray, focal, depth)) : 0.0;
  if (!exact) return error;
  const double begin = *exact / ray.toward_W.norm();
  constexpr int kSamples = 50;
  for (int i = 0; i < kSamples && begin < end; ++i) {
    error = std::max(error, -gap_px(terrain, ray, focal, begin + (end - begin) * i / kSamples));
  }
  return error;
}

// A place of the ground on its texture, which is mirrored at each border.
double folded(double place, double size) {
  const double in_pair = place - 2.0 * size * std::floor(place / (2.0 * size));
  return std::min(in_pair, 2.0 * size - in_pair);
}

Lanes lane_by_lane(double (*value)(Rng&), Rng& rng) {
  Lanes lanes;
  for (int k = 0; k < kLanes; ++k) lanes[k] = static_cast<float>(value(rng));
  return lanes;
}

}  // namespace

TEST_CASE("ground caster: rays meet the ground where exact rays do, and are free as far as it says") {
  constexpr float kFocal = 385.0F;
  Rng rng(3);
  int met = 0, missed = 0, known = 0;
  double worst = 0.0;
  for (const std::string sequence : {"wave1", "slope", "lawn"}) {
    const Terrain terrain = find_sequence(sequence).terrain;
    for (int trial = 0; trial < 1000; ++trial) {
      const double x = uniform(rng, -5.0, 15.0);
      const double y = uniform(rng, -5.0, 15.0);
      const Eigen::Vector3d eye_W(x, y, terrain.height(x, y) + uniform(rng, 0.1, 1.0));
      const GroundCaster caster(terrain, eye_W, kFocal, kFarthest);
      const auto across = [](Rng& r) { return uniform(r, -1.0, 1.0); };
      const auto down = [](Rng& r) { return uniform(r, -0.5, 0.2); };
      const auto little = [](Rng& r) { return uniform(r, -0.02, 0.02); };
      const RayLanes lower{Lanes::Ones(), lane_by_lane(across, rng), lane_by_lane(down, rng)};
      const RayLanes rays{lower.x, lower.y + lane_by_lane(little, rng), lower.z + lane_by_lane(little, rng)};
      const Lanes lower_depth = caster.cast(lower, caster.free_depth(lower)).depth;
      const Lanes free = caster.free_depth(rays, lower, lower_depth);
      const Lanes depth = caster.cast(rays, free).depth;
      for (int k = 0; k < kLanes; ++k) {
        const Ray ray{eye_W, Eigen::Vector3f(rays.x[k], rays.y[k], rays.z[k]).cast<double>()};
        worst = std::max(worst, error_px(terrain, ray, kFocal, double{depth[k]}));
        ++(std::isfinite(depth[k]) ? met : missed);
        if (free[k] > caster.free_depth(rays)[k]) ++known;
      }
    }
  }
  MESSAGE("worst " << worst << " px");
  CHECK(worst < 0.02);
  CHECK(met > 5000);
  CHECK(missed > 5000);
  CHECK(known > 5000);
}

TEST_CASE("ground view: each pixel meets the ground where an exact ray meets it, < 0.05 px") {
  constexpr float kRight = 0.4F;
  constexpr float kDown = -0.2F;
  constexpr int kGroundSurface = 7;
  for (const std::string sequence : {"wave1", "wave2", "wave3", "slope", "lawn"}) {
    CAPTURE(sequence);
    const Simulation simulation(ideal(sequence, 71));
    const ear::CameraCalibration& camera = simulation.true_calibration().cameras[0];
    const auto focal = static_cast<float>(camera.fu);
    const PixelRays rays = make_rays(camera, {kRight, kDown});
    const Lattice lattice = make_lattice(camera);
    const Scene& scene = simulation.scene();
    int hits = 0, contradictions = 0;
    double worst = 0.0, worst_place = 0.0;
    for (const double share : {0.25, 0.45, 0.85}) {
      const Trajectory& trajectory = simulation.plan().trajectory;
      const Eigen::Isometry3d T_WC = pose_WC(trajectory, share * trajectory.duration(), camera);
      GroundView view({scene.terrain, scene.size, 500.0F, kGroundSurface, kFarthest},
                      {lattice, rays, camera.width, camera.height, kRight, kDown, focal}, T_WC);
      int filled = 0;
      for (int v = camera.height - 1; v >= 0; --v) {
        for (int left = 0; left < camera.width; left += kTile) {
          const float least = view.farthest_in(left, v / kTile * kTile);
          if (least > 0.0F) ++filled;
          Row row{};
          row.x = rays.x.data() + rays.index(left, v);
          row.y = rays.y.data() + rays.index(left, v);
          row.clear();
          view.see(left, v, row);
          if (v % 5 != 0) continue;  // an exact ray costs more than all the others
          for (std::size_t i = 0; i < kTile; ++i) {
            const Ray ray{T_WC.translation(), T_WC.linear() * Eigen::Vector3d(double{row.x[i]}, double{row.y[i]}, 1.0)};
            if (row.surface[i] == kNothing) {
              worst = std::max(worst, error_px(scene.terrain, ray, focal, std::numeric_limits<double>::infinity()));
              if (least > 0.0F) ++contradictions;
              continue;
            }
            ++hits;
            const double depth = 1.0 / double{row.inverse_depth[i]};
            worst = std::max(worst, error_px(scene.terrain, ray, focal, depth));
            const Eigen::Vector3d p_W = ray.eye_W + depth * ray.toward_W;
            worst_place = std::max({worst_place, std::abs(double{row.a[i]} - folded(p_W.x(), scene.size.x())),
                                    std::abs(double{row.b[i]} - folded(p_W.y(), scene.size.y()))});
            if (row.surface[i] != kGroundSurface || row.inverse_depth[i] < least) ++contradictions;
          }
        }
      }
      CHECK(filled > 1000);  // rows of tiles
    }
    MESSAGE(sequence << ": worst of " << hits << ": " << worst << " px, place " << worst_place << " m");
    CHECK(hits > 40000);
    CHECK(contradictions == 0);
    CHECK(worst < 0.05);
    CHECK(worst_place < 1e-4);
  }
}

}  // namespace ear::simulator
