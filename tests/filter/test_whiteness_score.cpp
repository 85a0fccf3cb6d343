#include "filter/ekf/whiteness_score.h"

#include <doctest/doctest.h>

#include <cmath>
#include <limits>
#include <random>

#include "tests/support/about.h"

using namespace ear;
using ear::test::about;

namespace {

constexpr TimeNs kStep = 20'000'000;  // 50 Hz
constexpr double kWalk = 1e-3;        // of the velocity in a step
constexpr double kNoise = 1e-2;       // of the sensor

/// A velocity that walks, and one sensor that measures it; the filter believes what it is told of both.
struct Filter {
  double x = 0.0;
  double variance = 1e-6;
  WhitenessScore score;
  TimeNs t_ns = 0;

  void step(double measured) {
    t_ns += kStep;
    variance += std::pow(kWalk * score.factor(), 2);
    const double innovation_variance = variance + kNoise * kNoise;
    score.add(measured - x, innovation_variance, t_ns);
    const double gain = variance / innovation_variance;
    x += gain * (measured - x);
    variance *= 1.0 - gain;
  }
};

struct Outcome {
  double factor = 0.0;  ///< mean of the second half
  double nees = 0.0;
};

/// The velocity walks by so many times what the filter is told; so does the sensor's noise.
Outcome run(double walk, double noise) {
  std::mt19937_64 rng{71};
  std::normal_distribution<double> normal;
  constexpr int runs = 40, steps = 10'000;  // 200 s each
  Outcome mean;
  for (int k = 0; k < runs; ++k) {
    Filter filter;
    double truth = 0.0;
    for (int i = 0; i < steps; ++i) {
      truth += walk * kWalk * normal(rng);
      filter.step(truth + noise * kNoise * normal(rng));
      if (2 * i < steps) continue;
      mean.factor += filter.score.factor() / (runs * steps / 2.0);
      mean.nees += std::pow(filter.x - truth, 2) / filter.variance / (runs * steps / 2.0);
    }
  }
  return mean;
}

}  // namespace

TEST_CASE("whiteness: of a filter that knows its noise nothing changes") {
  const Outcome right = run(1.0, 1.0);
  CHECK(right.factor < 1.2);
  CHECK(right.nees == about(1.0, 0.15));
}

TEST_CASE("whiteness: a state that moves more than was said is found, and its covariance is right again") {
  const Outcome faster = run(5.0, 1.0);
  CHECK(faster.factor == about(5.0, 0.3));
  CHECK(faster.nees == about(1.0, 0.3));
  CHECK(run(100.0, 1.0).factor > 9.0);
  CHECK(run(100.0, 1.0).factor <= 10.0);
}

TEST_CASE("whiteness: a sensor that is noisier than was said is hardly taken for it") {
  CHECK(run(1.0, 3.0).factor < 2.5);
}

TEST_CASE("whiteness: a pause, few innovations and what is no number") {
  WhitenessScore score;
  TimeNs t_ns = 0;
  for (int i = 0; i < 50; ++i) {  // alike, but one every three seconds
    score.add(2.0, 1.0, t_ns += 3'000'000'000);
  }
  CHECK(score.factor() == 1.0);
  for (int i = 0; i < 50; ++i) score.add(2.0, 1.0, t_ns += 1'100'000'000);  // two at a time
  CHECK(score.factor() == 1.0);
  for (int i = 0; i < 500; ++i) score.add(std::numeric_limits<double>::quiet_NaN(), 1.0, t_ns += kStep);
  CHECK(std::isfinite(score.factor()));
  for (int i = 0; i < 5000; ++i) score.add(0.1, 1.0, t_ns += kStep);
  for (int i = 0; i < 5000; ++i) score.add(i % 2 == 0 ? 0.1 : -0.1, 1.0, t_ns += kStep);
  CHECK(score.factor() == 1.0);
}
