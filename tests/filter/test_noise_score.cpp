#include "filter/ekf/noise_score.h"
#include "tests/support/about.h"

#include <doctest/doctest.h>

#include <cmath>
#include <random>

using namespace ear;
using ear::test::about;

namespace {

constexpr TimeNs kStep = 20'000'000;  // 50 Hz

constexpr double kWalk = 1e-4;  // of the velocity in a step

/// A velocity that one sensor measures with noise of 0.01, in a filter that believes its state to 0.01.
struct Filter {
  double x = 0.0;
  double variance = 1e-4;
  double walk = kWalk * kWalk;  ///< variance
  NoiseScore score;
  TimeNs t_ns = 0;

  double step(double measured) {
    t_ns += kStep;
    variance += walk;
    const double noise = 1e-4 * score.add(measured - x, {variance, 1e-4}, t_ns);
    const double gain = variance / (variance + noise);
    x += gain * (measured - x);
    variance *= 1.0 - gain;
    return noise;
  }
};

}  // namespace

TEST_CASE("noise_score: a sensor as good as it should be keeps its weight, and the estimate its covariance") {
  std::mt19937_64 rng{41};
  std::normal_distribution<double> normal;
  double sum = 0.0, squares = 0.0;
  int fits = 0;
  for (int run = 0; run < 200; ++run) {
    Filter filter;
    double truth = 1e-2 * normal(rng);
    for (int i = 0; i < 200; ++i) {
      truth += kWalk * normal(rng);
      filter.step(truth + 1e-2 * normal(rng));
      sum += filter.score.weight();
      fits += filter.score.fits() ? 1 : 0;
    }
    squares += std::pow(filter.x - truth, 2) / filter.variance;
  }
  CHECK(sum / (200 * 200) > 0.9);
  CHECK(fits == 200 * 200);
  CHECK(squares / 200 == about(1.0, 0.25));
}

TEST_CASE("noise_score: noise that is larger than it should be is found, at any rate") {
  std::mt19937_64 rng{42};
  std::normal_distribution<double> normal;
  for (const double times : {3.0, 10.0}) {
    for (const TimeNs step : {2'000'000, 20'000'000}) {
      CAPTURE(times);
      NoiseScore score;
      double sum = 0.0;
      for (int i = 1; i <= 3000; ++i) {
        score.add(times * 1e-2 * normal(rng), {1e-6, 1e-4}, i * step);
        if (i > 1000) sum += score.weight();
      }
      CHECK(sum / 2000 > 0.8 / times);
      CHECK(sum / 2000 < 2.0 / times);
    }
  }
}

TEST_CASE("noise_score: a slip moves a state by little, however long; the sensor comes back afterwards") {
  for (const double slip : {0.2, 1.0, 20.0}) {
    CAPTURE(slip);
    Filter filter;
    for (int i = 0; i < 50; ++i) filter.step(0.0);
    for (int i = 0; i < 250; ++i) filter.step(slip);
    CHECK(std::abs(filter.x) < 0.01);
    CHECK_FALSE(filter.score.fits());
    int steps = 0;
    while (!filter.score.fits()) {
      filter.step(0.0);
      ++steps;
    }
    CHECK(1e-9 * static_cast<double>(steps * kStep) < 2.0);
  }
}

TEST_CASE("noise_score: a state that ran away is brought back") {
  Filter filter;
  filter.x = 0.5;
  filter.variance = filter.walk = 1e-6;  // and it is sure of itself
  for (int i = 0; i < 50 * 60; ++i) filter.step(0.0);
  CHECK(std::abs(filter.x) < 0.05);
}

TEST_CASE("noise_score: what the state does not know is no fault of the sensor") {
  NoiseScore score;
  CHECK(score.add(1.0, {1.0, 1e-4}, kStep) < 1.5);
  CHECK(score.fits());
}

TEST_CASE("noise_score: what is no number does not fit") {
  NoiseScore score;
  score.add(std::nan(""), {1e-4, 1e-4}, kStep);
  CHECK(score.weight() < 0.01);
  for (int i = 2; i < 200; ++i) score.add(0.0, {1e-6, 1e-4}, i * kStep);
  CHECK(score.weight() > 0.9);
}
