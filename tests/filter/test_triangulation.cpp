#include <doctest/doctest.h>

#include <random>

#include "filter/sources/cameras/triangulation.h"
#include "tests/support/random_state.h"

using namespace ear;
using namespace ear::test;

namespace {

/// Cameras looking along world x from around the origin, and what they see of a point.
std::vector<Sighting> sightings_of(const Eigen::Vector3d& f_W, int count, double spread, std::mt19937_64& rng,
                                   double noise = 0.0) {
  Eigen::Matrix3d R_WC;
  R_WC << 0, 0, 1, -1, 0, 0, 0, -1, 0;
  std::vector<Sighting> sightings;
  for (int i = 0; i < count; ++i) {
    Sighting s;
    s.R_CW = (exp_so3(random_vector(rng, 0.05)) * R_WC).transpose();
    s.p_WC = random_vector(rng, spread);
    const Eigen::Vector3d f_C = s.R_CW * (f_W - s.p_WC);
    s.uv = f_C.hnormalized() + noise * random_vector(rng, 1.0).head<2>();
    sightings.push_back(s);
  }
  return sightings;
}

}  // namespace

TEST_CASE("triangulation: exact rays meet in the point, near and far") {
  std::mt19937_64 rng{41};
  for (const double depth : {0.4, 2.0, 20.0, 500.0}) {
    CAPTURE(depth);
    const Eigen::Vector3d f_W{depth, 0.2 * depth, -0.1 * depth};
    const auto point = triangulate(sightings_of(f_W, 6, 0.05, rng));
    REQUIRE(point);
    CHECK((point->scaled_W() - point->inverse_depth * f_W).norm() < 1e-6);
    CHECK(point->inverse_depth > 0.0);
  }
}

TEST_CASE("triangulation: a point at infinity keeps its direction") {
  std::mt19937_64 rng{42};
  const Eigen::Vector3d direction = Eigen::Vector3d(1.0, 0.3, 0.1).normalized();
  const auto point = triangulate(sightings_of(1e7 * direction, 5, 0.1, rng));
  REQUIRE(point);
  CHECK(std::abs(point->inverse_depth) < 1e-5);
  CHECK((point->scaled_W().normalized() - direction).norm() < 1e-5);
}

TEST_CASE("triangulation: with noise it is the least-squares point") {
  std::mt19937_64 rng{43};
  const auto sightings = sightings_of({3.0, 0.5, 0.2}, 8, 0.2, rng, 1e-3);
  const auto point = triangulate(sightings);
  REQUIRE(point);
  const Eigen::Vector3d f_W = point->scaled_W() / point->inverse_depth;
  const auto cost = [&](const Eigen::Vector3d& f) {
    double sum = 0.0;
    for (const Sighting& s : sightings) sum += (s.uv - (s.R_CW * (f - s.p_WC)).hnormalized()).squaredNorm();
    return sum;
  };
  for (int axis = 0; axis < 3; ++axis) {
    for (const double step : {-1e-4, 1e-4}) CHECK(cost(f_W) < cost(f_W + step * Eigen::Vector3d::Unit(axis)));
  }
}

TEST_CASE("triangulation: refuses one ray, and rays that meet behind the cameras") {
  std::mt19937_64 rng{44};
  CHECK_FALSE(triangulate(sightings_of({2.0, 0.0, 0.0}, 1, 0.1, rng)));
  Sighting a, b;  // parallel cameras, x to the right; the point drifts right in the right camera: beyond infinity
  a.R_CW = b.R_CW = Eigen::Matrix3d::Identity();
  a.p_WC = Eigen::Vector3d::Zero();
  b.p_WC = {0.1, 0.0, 0.0};
  a.uv = {0.0, 0.0};
  b.uv = {0.05, 0.0};
  CHECK_FALSE(triangulate({a, b}));
}
