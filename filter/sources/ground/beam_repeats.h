// Does a beam give the same range again and again? Noise makes each reading of a working one another, unless it reads
// in steps that are larger than its noise, or less often than it is asked: its changes show it. docs/filter.md, "Beams
// that repeat".
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
  using Property = bool (BeamRepeats::*)() const;

  /// Readings in time order [m].
  void add(double range) {
    const double step = std::abs(range - last_);
    last_ = range;
    same_ = step == 0.0 ? same_ + 1 : 1;
    if (same_ <= kNoChance) again_.add(step == 0.0);  // however long a beam is stuck, it is not usual
    if (!(step > 0.0)) return;
    if (step < smallest_ * (1.0 - kAlike)) single_.share = 0.0;  // what was counted were several of these
    smallest_ = std::min(smallest_, step);
    single_.add(step < smallest_ * (1.0 + kAlike));
  }

  /// Is the last reading no new one? Of normal noise in steps, readings repeat less often than their changes are single
  /// steps: where they repeat more often, it is not by chance.
  [[nodiscard]] bool repeats() const { return same_ > 1 && reads_finely() && again_.share > single_.share; }

  /// Equal readings in a row that are no chance, nor usual.
  [[nodiscard]] bool stuck() const {
    return same_ >= kNoChance && reads_finely() && is_no_chance(std::max(single_.share, again_.share), same_ - 1);
  }

 private:
  /// A beam that reads in coarse steps may measure the same again.
  [[nodiscard]] bool reads_finely() const { return single_.count >= kToKnow && single_.share <= kAlike; }

  struct Share {
    double share = 0.0, count = 0.0;

    void add(bool is) {
      count = std::min<double>(count + 1.0, kCapacity);
      share += ((is ? 1.0 : 0.0) - share) / count;
    }
  };

  double last_ = 0.0;
  int same_ = 0;                                               // readings in a row with this range
  double smallest_ = std::numeric_limits<double>::infinity();  // of its changes [m]
  Share single_;                                               // of the changes that are the smallest
  Share again_;                                                // of the readings that repeat
};

}  // namespace ear
