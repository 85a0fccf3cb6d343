// Slip of both wheels alike, as a random walk beside white noise.
#include "calibration/common_slip.h"
#include "tests/support/about.h"

#include <doctest/doctest.h>

#include <cmath>
#include <random>

using namespace ear::calibration;
using ear::test::about;

namespace {

struct Drawn {
  double walk = 0.0;       ///< [m/sqrt(m)]
  double white = 0.05;     ///< [m]
  double scale = 2e-3;     ///< of the wheels, wrong
  double spacing = 1.0;    ///< [m]
  double length = 1000.0;  ///< [m]
};

std::vector<Ahead> draw(const Drawn& drawn, std::uint32_t seed) {
  std::mt19937 random(seed);
  std::normal_distribution<double> normal;
  std::vector<Ahead> along;
  double walked = 0.7;
  for (double way = 0.0; way < drawn.length; way += drawn.spacing) {
    along.push_back({way, walked + drawn.scale * way + drawn.white * normal(random)});
    walked += drawn.walk * std::sqrt(drawn.spacing) * normal(random);
  }
  return along;
}

/// Root of the mean square over many draws.
double found(const Drawn& drawn) {
  constexpr std::uint32_t kDraws = 100;
  double sum = 0.0;
  for (std::uint32_t seed = 1; seed <= kDraws; ++seed) {
    const double walk = walk_along(draw(drawn, seed)).value();
    sum += walk * walk;
  }
  return std::sqrt(sum / kDraws);
}

}  // namespace

TEST_CASE("common slip: a random walk is found beside an offset, a wrong scale and white noise") {
  Drawn drawn;
  drawn.walk = 0.01;
  CHECK(found(drawn) == about(0.01, 0.12));
  drawn.white = 0.5;
  drawn.walk = 0.05;
  CHECK(found(drawn) == about(0.05, 0.12));
}

TEST_CASE("common slip: white noise alone is hardly taken for a walk") {
  // As a walk it would have to bring 0.05 m / sqrt(12) of a knot's mean over some 50 m.
  CHECK(found(Drawn{}) < 1e-3);
}

TEST_CASE("common slip: nothing from a drive that is too short or has no way") {
  CHECK(!walk_along({}));
  CHECK(!walk_along({{1.0, 0.0}, {1.0, 0.1}}));
  std::vector<Ahead> few;
  for (int i = 0; i < 5; ++i) few.push_back({100.0 * i, 0.0});
  CHECK(!walk_along(few));
}
