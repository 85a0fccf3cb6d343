#include "filter/ekf/gate.h"

#include <algorithm>
#include <cmath>

namespace ear {
namespace {

/// Probability that a chi-squared variable of `dof` degrees of freedom is below x.
double chi_squared_probability(double x, int dof) {
  if (x <= 0.0) return 0.0;
  // Regularized incomplete gamma function by its series, Abramowitz and Stegun 6.5.29.
  const double a = 0.5 * dof;
  const double half = 0.5 * x;
  double term = std::exp(a * std::log(half) - half - std::lgamma(a + 1.0));
  double sum = term;
  for (int n = 1; n < 10000 && term > 1e-16 * sum; ++n) {
    term *= half / (a + n);
    sum += term;
  }
  return std::min(sum, 1.0);
}

}  // namespace

Gate::Gate(double probability, int max_dof) {
  quantiles_.reserve(static_cast<std::size_t>(max_dof));
  for (int dof = 1; dof <= max_dof; ++dof) {
    double low = 0.0;
    double high = 10.0;
    while (chi_squared_probability(high, dof) < probability && high < 1e4) high *= 2.0;
    for (int i = 0; i < 50; ++i) {
      const double middle = 0.5 * (low + high);
      (chi_squared_probability(middle, dof) < probability ? low : high) = middle;
    }
    quantiles_.push_back(0.5 * (low + high));
  }
}

double Gate::quantile(int dof) const {
  const auto index = std::clamp<std::size_t>(static_cast<std::size_t>(std::max(dof, 1)), 1, quantiles_.size());
  return quantiles_[index - 1];
}

}  // namespace ear
