// Slip of the wheels, told from their difference beside the noise of encoders and gyroscope.
#include "calibration/noise_estimate.h"

#include <doctest/doctest.h>

#include <cmath>
#include <random>

using namespace ear::calibration;

namespace {

/// Of intervals of 0.2 s at speeds up to 1 m/s, wheels 0.4 m apart, 1e-3 rad/s/sqrt(Hz).
std::vector<WheelDifference> draw(double slip, double share_wild, std::uint32_t seed) {
  constexpr double kKnown = 0.4 * 0.4 * 1e-6 * 0.2;
  std::mt19937 random(seed);
  std::normal_distribution<double> normal;
  std::uniform_real_distribution<double> uniform;
  std::vector<WheelDifference> differences;
  for (int i = 0; i < 600; ++i) {
    const double way = 0.4 * (0.05 + 0.95 * uniform(random));
    double error = std::sqrt(kKnown + slip * slip * way) * normal(random);
    if (uniform(random) < share_wild) error += 5e-3 * normal(random);
    differences.push_back({error, kKnown, way});
  }
  return differences;
}

/// Root of the mean square over many draws.
double found(double slip, double share_wild = 0.0) {
  constexpr std::uint32_t kDraws = 100;
  double sum = 0.0;
  for (std::uint32_t seed = 1; seed <= kDraws; ++seed) {
    sum += std::pow(slip_walk(draw(slip, share_wild, seed)), 2);
  }
  return std::sqrt(sum / kDraws);
}

}  // namespace

TEST_CASE("slip: found where the gyroscope hides most of it, and not made up where there is none") {
  CHECK(std::abs(found(1e-3) / 1e-3 - 1.0) < 0.05);
  CHECK(std::abs(found(2e-4) / 2e-4 - 1.0) < 0.1);
  CHECK(found(0.0) < 8e-5);  // 600 intervals tell the gyroscope's 1.8e-4 m to 3 %
}

TEST_CASE("slip: wheels that spin now and then count little") {
  CHECK(found(1e-3, 0.05) < 1.2e-3);
  CHECK(found(0.0, 0.05) < 2.5e-4);
}
