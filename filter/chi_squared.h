// Gates of the innovation tests.
#pragma once

#include <vector>

namespace ear {

/// Quantiles of the chi-squared distribution at one probability, for 1 to max_dof degrees of freedom.
class ChiSquaredGate {
 public:
  /// `probability` in (0, 1).
  ChiSquaredGate(double probability, int max_dof);

  /// The quantile; the largest dof stands for all above.
  [[nodiscard]] double operator()(int dof) const;

 private:
  std::vector<double> quantiles_;  // [dof - 1]
};

/// Probability that a chi-squared variable of `dof` degrees of freedom is below x.
[[nodiscard]] double chi_squared_probability(double x, int dof);

}  // namespace ear
