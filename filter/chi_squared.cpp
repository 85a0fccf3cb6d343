#include "filter/chi_squared.h"

#include <algorithm>
#include <cmath>

namespace ear {

double normal_quantile(double probability) {
  // Newton on the cumulative distribution; it is concave above and convex below zero, and a start at 0 never
  // overshoots.
  constexpr double kSqrt2 = 1.4142135623730951;
  constexpr double kInvSqrt2Pi = 0.3989422804014327;
  double x = 0.0;
  for (int i = 0; i < 100; ++i) {
    const double excess = 0.5 * std::erfc(-x / kSqrt2) - probability;
    const double step = excess / (kInvSqrt2Pi * std::exp(-0.5 * x * x));
    x -= step;
    if (std::abs(step) < 1e-12) break;
  }
  return x;
}

ChiSquaredGate::ChiSquaredGate(double probability, int max_dof) {
  const double z = normal_quantile(probability);
  quantiles_.reserve(static_cast<std::size_t>(max_dof));
  for (int dof = 1; dof <= max_dof; ++dof) {
    if (dof == 1) {  // exact: the square of a normal variable
      const double two_sided = normal_quantile(0.5 + 0.5 * probability);
      quantiles_.push_back(two_sided * two_sided);
      continue;
    }
    if (dof == 2) {  // exact: exponential
      quantiles_.push_back(-2.0 * std::log1p(-probability));
      continue;
    }
    const double a = 2.0 / (9.0 * dof);
    quantiles_.push_back(dof * std::pow(1.0 - a + z * std::sqrt(a), 3));
  }
}

double ChiSquaredGate::operator()(int dof) const {
  const auto index = std::clamp<std::size_t>(static_cast<std::size_t>(std::max(dof, 1)), 1, quantiles_.size());
  return quantiles_[index - 1];
}

}  // namespace ear
