// The gate: does an innovation fit what is expected of it? Features must pass it; wheels and beams have scores.
#pragma once

#include <utility>
#include <vector>

namespace ear {

class Gate {
 public:
  /// The quantiles of the chi-squared distribution at `probability`, in (0, 1), for 1 to max_dof degrees of freedom.
  Gate(double probability, int max_dof);

  /// These thresholds, for 1, 2, ... degrees of freedom.
  explicit Gate(std::vector<double> quantiles) : quantiles_(std::move(quantiles)) {}

  /// The quantile; the largest dof stands for all above.
  [[nodiscard]] double quantile(int dof) const;

  /// A sum of squares of `dof` innovations, each of this variance. With variance 1: r^T S^-1 r.
  [[nodiscard]] bool fits(double squares, double variance, int dof) const {
    return squares <= quantile(dof) * variance;
  }

 private:
  std::vector<double> quantiles_;  // [dof - 1]
};

}  // namespace ear
