// Gates of the innovation tests.
#pragma once

#include <vector>

namespace ear {

/// Quantiles of the chi-squared distribution at one probability, for 1 to max_dof degrees of freedom.
class ChiSquaredGate {
 public:
  /// `probability` in (0, 1). Wilson and Hilferty (1931): within 0.5 % for the probabilities that gates use.
  ChiSquaredGate(double probability, int max_dof);

  /// The quantile; the largest dof stands for all above.
  [[nodiscard]] double operator()(int dof) const;

 private:
  std::vector<double> quantiles_;  // [dof - 1]
};

/// The quantile of the standard normal distribution, |error| < 1e-8. `probability` in (0, 1).
[[nodiscard]] double normal_quantile(double probability);

}  // namespace ear
