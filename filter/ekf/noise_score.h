// The score of one sensor, from how its innovations have fitted over the last moments: its noise is divided by it at
// every update. Variational noise adaptation (Sarkka and Nummenmaa 2009): the factor on the noise's variance has an
// inverse-gamma belief, whose mean follows the innovations. One that is far off raises it before it is used, which is
// a Student-t update; many raise it for all. It forgets with time, whatever the sensor's rate. docs/filter.md,
// "Wheels".
#pragma once

#include <optional>

#include "ear/types.h"
#include "filter/ekf/records.h"

namespace ear {

class NoiseScore {
 public:
  /// [s] measured: 0.4 s costs 5 to 30 % where wheels slip; docs/decisions/0018
  static constexpr double kShortMemory = 0.15;

  NoiseScore() = default;
  /// `memory` [s]: how long innovations count. `farthest`: one innovation's square over the usual variance counts as no
  /// more.
  NoiseScore(double memory, double farthest) : memory_(memory), farthest_(farthest) {}

  /// What an innovation is compared with: the variances of its parts.
  struct Expected {
    double state = 0.0;  ///< by the state's error
    double noise = 0.0;  ///< by the sensor's noise, as it usually is
    bool adapts = true;  ///< false: the noise stays as it usually is
  };

  /// A residual at `t_ns`. The factor, at least 1, that the noise's variance is to be multiplied by. What the state
  /// contradicts weighs less and less, but never nothing: the state may be what is wrong, and the pull that is left
  /// brings it back.
  double add(double residual, const Expected& expected, TimeNs t_ns);
  /// The same of an innovation whose variance has the noise's, `sigma` squared, as a part.
  double add(const Innovation& innovation, double sigma, bool adapts, TimeNs t_ns) {
    const double noise = sigma * sigma;
    return add(innovation.value, {innovation.variance - noise, noise, adapts}, t_ns);
  }

  /// In (0, 1]: 1 over the root of the believed factor.
  [[nodiscard]] double weight() const;
  /// Did the last innovations fit, by and large?
  [[nodiscard]] bool fits() const;

 private:
  [[nodiscard]] double factor(double square, double count) const;

  double memory_ = kShortMemory;
  double farthest_ = 1e6;  // chosen: a reading may be as wrong as it likes
  double squares_ = 0.0;   ///< of past noises over the usual variance, recent ones
  double count_ = 0.0;     ///< how many they are
  std::optional<TimeNs> last_ns_;
};

}  // namespace ear
