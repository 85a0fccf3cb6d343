#include <doctest/doctest.h>

#include <cmath>

#include "tools/evaluation/terrain.h"

namespace ear::evaluation {
namespace {

TerrainComparison comparison(bool truly_on_ground, double z_error) {
  TerrainComparison result;
  result.truth.on_ground = truly_on_ground;
  result.z_error = z_error;
  return result;
}

TEST_CASE("terrain: slopes are interpolated, the mode is held, nothing is extrapolated") {
  const std::vector<TerrainTruth> terrain{{10, true, {0.1, 0.0}}, {20, false, {0.3, -0.4}}, {30, true, {0.3, -0.4}}};
  CHECK_FALSE(terrain_at(terrain, 9));
  CHECK_FALSE(terrain_at(terrain, 31));
  CHECK_FALSE(terrain_at({}, 9));
  CHECK(terrain_at(terrain, 30)->on_ground);
  const std::optional<TerrainTruth> between = terrain_at(terrain, 15);
  REQUIRE(between);
  CHECK(between->on_ground);
  CHECK(between->slope.along == doctest::Approx(0.2));
  CHECK(between->slope.across == doctest::Approx(-0.2));
  CHECK_FALSE(terrain_at(terrain, 20)->on_ground);
}

TEST_CASE("terrain: height counts on the ground, the mode everywhere") {
  std::vector<TerrainComparison> comparisons{comparison(true, 0.3), comparison(true, -0.4), comparison(false, 7.0)};
  const TerrainFigures silent = terrain_figures(comparisons);
  CHECK(silent.ground_poses == 2);
  CHECK(*silent.z_rmse == doctest::Approx(std::sqrt(0.125)));
  CHECK_FALSE(silent.mode_agreement);
  CHECK_FALSE(silent.along);
  for (TerrainComparison& c : comparisons) c.estimate = TerrainEstimate{true, std::nullopt, {}};
  CHECK(*terrain_figures(comparisons).mode_agreement == doctest::Approx(2.0 / 3.0));
  CHECK_FALSE(terrain_figures({comparison(false, 1.0)}).z_rmse);
}

TEST_CASE("terrain: the slope's error counts where truth and estimate know one") {
  TerrainComparison good = comparison(true, 0.0);
  good.truth.slope = {0.2, 0.1};
  good.estimate = TerrainEstimate{true, Slope{0.17, 0.14}, {0.0101, 0.0133}};  // 2.97 and 3.01 sigma off
  TerrainComparison flying = good;
  flying.truth.on_ground = false;
  TerrainComparison unknown = good;
  unknown.estimate->slope.reset();
  const TerrainFigures figures = terrain_figures({good, flying, unknown, good});
  REQUIRE(figures.along);
  REQUIRE(figures.across);
  CHECK(figures.along->poses == 2);
  CHECK(figures.along->rmse == doctest::Approx(0.03));
  CHECK(figures.along->inside == 1.0);
  CHECK(figures.across->rmse == doctest::Approx(0.04));
  CHECK(figures.across->inside == 0.0);
}

}  // namespace
}  // namespace ear::evaluation
