// Does a beam give the same range again and again? Noise makes each reading of a working one another, unless it reads
// in steps that are larger than its noise: how often its range changes by the smallest step shows it. docs/filter.md,
// "Beams that repeat".
#pragma once

#include <algorithm>
#include <cmath>
#include <limits>

#include "filter/ingest/limits.h"

namespace ear {

/// Chosen: readings in a row that are equal, or agree again; noise makes two equal ones a chance of some percent.
inline constexpr int kNoChance = 5;

class BeamRepeats {
 public:
  /// Returns in time order [m].
  void add(double range) {
    const double step = std::abs(range - last_);
    last_ = range;
    same_ = step == 0.0 ? same_ + 1 : 1;
    if (!(step > 0.0)) return;
    if (step < smallest_ * (1.0 - kAlike)) single_ = 0.0;  // what was counted were several of these
    smallest_ = std::min(smallest_, step);
    changes_ = std::min<double>(changes_ + 1.0, kCapacity);
    single_ += ((step < smallest_ * (1.0 + kAlike) ? 1.0 : 0.0) - single_) / changes_;
  }

  /// Equal readings in a row that are no chance. Of normal noise in steps, readings repeat less often than their
  /// changes are single steps.
  [[nodiscard]] bool stuck() const {
    const bool coarse = changes_ < kToKnow || single_ > kAlike;
    return same_ >= kNoChance && !coarse && std::pow(single_, same_ - 1) < std::exp(-kClear * kClear);
  }

 private:
  double last_ = 0.0;
  int same_ = 0;                                               // readings in a row with this range
  double smallest_ = std::numeric_limits<double>::infinity();  // [m] of its changes
  double changes_ = 0.0;
  double single_ = 0.0;  // share of the changes that are the smallest, in the mean
};

}  // namespace ear
