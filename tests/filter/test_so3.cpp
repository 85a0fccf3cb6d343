#include <doctest/doctest.h>

#include <random>

#include "filter/ekf/so3.h"
#include "tests/support/check_jacobian.h"
#include "tests/support/random_state.h"

using namespace ear;
using namespace ear::test;

TEST_CASE("so3: a turn about z by 90 degrees takes x to y") {
  const Eigen::Vector3d turned = exp_so3({0.0, 0.0, M_PI / 2.0}) * Eigen::Vector3d::UnitX();
  CHECK((turned - Eigen::Vector3d::UnitY()).norm() < 1e-12);
}

TEST_CASE("so3: the logarithm undoes the exponential, up to half a turn") {
  std::mt19937_64 rng{1};
  for (const double angle : {0.0, 1e-13, 1e-7, 1e-3, 0.5, 3.0, 3.14159}) {
    CAPTURE(angle);
    const Eigen::Vector3d phi = angle * random_vector(rng, 1.0).normalized();
    CHECK((log_so3(exp_so3(phi)) - phi).norm() < 1e-9);
  }
}

TEST_CASE("so3: gamma is the series, on both sides of the switch to it") {
  std::mt19937_64 rng{2};
  const auto series = [](const Eigen::Vector3d& phi, int m) {
    Eigen::Matrix3d power = Eigen::Matrix3d::Identity();
    Eigen::Matrix3d sum = Eigen::Matrix3d::Zero();
    for (int k = 0; k < 25; ++k) {
      sum += power / std::tgamma(k + m + 1);
      power = power * skew(phi);
    }
    return sum;
  };
  for (const double angle : {0.0, 1e-5, 0.9e-3, 1.1e-3, 0.02, 1.0, 2.5}) {
    CAPTURE(angle);
    const Eigen::Vector3d phi = angle * random_vector(rng, 1.0).normalized();
    CHECK((gamma<0>(phi) - series(phi, 0)).norm() < 1e-10);
    CHECK((gamma<1>(phi) - series(phi, 1)).norm() < 1e-10);
    CHECK((gamma<2>(phi) - series(phi, 2)).norm() < 1e-9);
  }
}

TEST_CASE("so3: derivative of gamma times a vector") {
  std::mt19937_64 rng{3};
  for (int trial = 0; trial < 20; ++trial) {
    CAPTURE(trial);
    const Eigen::Vector3d phi = random_vector(rng, 0.03);
    const Eigen::Vector3d a = random_vector(rng, 10.0);
    check_jacobian([&](const Eigen::VectorXd& d) -> Eigen::VectorXd { return gamma<1>(Eigen::Vector3d(phi + d)) * a; },
                   gamma_derivative<1>(phi, a), 1e-7);
    check_jacobian([&](const Eigen::VectorXd& d) -> Eigen::VectorXd { return gamma<2>(Eigen::Vector3d(phi + d)) * a; },
                   gamma_derivative<2>(phi, a), 1e-7);
  }
}
