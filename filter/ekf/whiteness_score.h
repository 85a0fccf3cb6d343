// Are the innovations of a sensor white, as those of a filter that knows its noise are? Where those that follow one
// another are alike, the state follows too slowly, and what moves it is noisier than was stated (Mehra 1970). Noise of
// the sensor itself makes them large, but hardly alike. docs/filter.md, "Propagation".
#pragma once

#include <optional>

#include "ear/types.h"

namespace ear {

class WhitenessScore {
 public:
  /// An innovation, and its variance as the update uses it.
  void add(double innovation, double variance, TimeNs t_ns);

  /// On the standard deviation of the noise that moves the state: 1 to 10.
  [[nodiscard]] double factor() const;

 private:
  std::optional<TimeNs> from_ns_;  ///< of the innovations at hand
  double sum_ = 0.0;               ///< of them, each over its standard deviation
  int count_ = 0;
  double log_factor_ = 0.0;  ///< on the variance
};

}  // namespace ear
