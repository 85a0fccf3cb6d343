// An update whose first order leaves out more than noise: its rows are linearised again where it would move the state.
// docs/filter.md, "Features".
#pragma once

#include <Eigen/Core>

#include "filter/ekf/state.h"

namespace ear {

/// The update is where the sum of squares, of the prior too, is least: found by Gauss-Newton, whose first step is the
/// ordinary update (Bell and Cathey 1993).
class IteratedUpdate {
 public:
  /// `window`: the most clones.
  explicit IteratedUpdate(int window) {
    found_.clones.reserve(static_cast<std::size_t>(window) + 1);
    moved_.setZero(err::clone(window + 1));
  }

  /// The rows, linearised at `x` so far, become those of where the update would end. `correction()`: the error that
  /// they would correct. `linearize(found, moved)`: takes them at the state `found`, which is `moved` from x, with the
  /// residuals of x: r + H moved. False: there are none.
  template <typename Correction, typename Linearize>
  void run(const State& x, const Correction& correction, const Linearize& linearize) {
    auto moved = moved_.head(x.error_size());
    for (int i = 0; i < kIterations; ++i) {
      moved = correction();
      found_ = x;
      boxplus(found_, moved);
      if (!linearize(static_cast<const State&>(found_), moved)) return;
    }
  }

 private:
  static constexpr int kIterations = 2;  // measured, docs/decisions/0059: one gives 3/4 of the gain, three no more

  State found_;            ///< where the update would move the state
  Eigen::VectorXd moved_;  ///< there, from the state, as an error
};

}  // namespace ear
