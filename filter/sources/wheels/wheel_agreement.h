// Do the two wheels agree, given how fast the axle turns by the gyroscope? One that hangs in the air,
// slips or has a broken encoder does not. docs/filter.md, "Wheels".
#pragma once

#include "ear/types.h"

namespace ear {

/// In place of the time since when something agrees.
inline constexpr TimeNs kDisagrees = -1;

/// A wheel that slips comes back through the speeds that a gate lets pass: it must have agreed for 0.15 s. `since_ns`
/// is kept between calls, 0 at the start; `passes`: does what came at t_ns agree?
[[nodiscard]] bool agrees_again(TimeNs& since_ns, bool passes, TimeNs t_ns);

class WheelAgreement {
 public:
  /// `difference`: right wheel's speed less the left's, less what the gyroscope's yaw rate makes of it [m/s]; `sigma`:
  /// its standard deviation from what the state does not know (bias, radii). In time order; after a pause of 0.1 s
  /// the wheels are thought to agree.
  void add(double difference, double sigma, TimeNs t_ns);

  /// False from the first sign of a contradiction until there was none for 0.15 s.
  [[nodiscard]] bool agree() const { return agree_; }
  /// The difference of late [m/s].
  [[nodiscard]] double difference() const { return difference_; }

 private:
  bool agree_ = true;
  bool any_ = false;
  double difference_ = 0.0;
  TimeNs last_ns_ = 0;
  TimeNs contradiction_ns_ = 0;  ///< the last one
};

}  // namespace ear
