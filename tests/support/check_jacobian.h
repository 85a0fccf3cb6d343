// Derivatives against central differences: one helper for all.
#pragma once

#include <doctest/doctest.h>

#include <Eigen/Core>
#include <algorithm>

namespace ear::test {

/// Checks J against the derivative at zero of f: error vector -> residual vector. Per column, relative to the column's
/// size (but at least 1e-3 of the largest), the error must be below `tolerance`. Step 1e-5, fourth order.
template <typename Function>
void check_jacobian(const Function& f, const Eigen::MatrixXd& J, double tolerance = 1e-5) {
  constexpr double kStep = 1e-4;
  const double largest = J.colwise().norm().maxCoeff();
  for (Eigen::Index column = 0; column < J.cols(); ++column) {
    CAPTURE(column);
    Eigen::VectorXd d = Eigen::VectorXd::Zero(J.cols());
    const auto at = [&](double step) -> Eigen::VectorXd {
      d(column) = step;
      return f(d);
    };
    const Eigen::VectorXd numeric =
        (8.0 * (at(kStep) - at(-kStep)) - (at(2.0 * kStep) - at(-2.0 * kStep))) / (12.0 * kStep);
    const double scale = std::max(J.col(column).norm(), 1e-3 * largest);
    CHECK((numeric - J.col(column)).norm() <= tolerance * scale);
  }
}

}  // namespace ear::test
