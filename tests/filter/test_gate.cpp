#include <doctest/doctest.h>

#include <random>

#include "filter/ekf/gate.h"

using namespace ear;

TEST_CASE("chi-squared: quantiles of printed tables") {
  // Abramowitz and Stegun, table 26.8.
  const Gate gate95(0.95, 100);
  CHECK(gate95.quantile(1) == doctest::Approx(3.8415).epsilon(1e-4));
  CHECK(gate95.quantile(2) == doctest::Approx(5.9915).epsilon(1e-4));
  CHECK(gate95.quantile(3) == doctest::Approx(7.8147).epsilon(1e-4));
  CHECK(gate95.quantile(10) == doctest::Approx(18.307).epsilon(1e-4));
  CHECK(gate95.quantile(100) == doctest::Approx(124.342).epsilon(1e-4));
  const Gate gate999(0.999, 40);
  CHECK(gate999.quantile(5) == doctest::Approx(20.515).epsilon(1e-4));
  CHECK(gate999.quantile(40) == doctest::Approx(73.402).epsilon(1e-4));
}

TEST_CASE("chi-squared: the gate lets through the share it promises") {
  std::mt19937_64 rng{51};
  std::normal_distribution<double> normal;
  const Gate gate(0.9, 30);
  for (const int dof : {1, 4, 30}) {
    CAPTURE(dof);
    constexpr int kDraws = 20000;
    int passed = 0;
    for (int i = 0; i < kDraws; ++i) {
      double sum = 0.0;
      for (int k = 0; k < dof; ++k) {
        const double x = normal(rng);
        sum += x * x;
      }
      passed += sum < gate.quantile(dof) ? 1 : 0;
    }
    CHECK(std::abs(static_cast<double>(passed) / kDraws - 0.9) < 4.0 * std::sqrt(0.09 / kDraws) + 0.002);
  }
}
