// Stamps of one stream, which should grow.
#pragma once

#include <optional>

#include "ear/types.h"

namespace ear::ros2 {

/// A message whose stamp is no later than the one before is left out. A few in a row that grow among themselves are
/// the stream as it goes on: what came before them had a false stamp, or the clock was set back.
class StampOrder {
 public:
  enum class Order { later, duplicate, earlier, anew };

  /// `later` and `anew` are to be used; what waits of before `anew` is of another clock.
  [[nodiscard]] Order take(TimeNs t_ns) {
    if (!last_ns_ || t_ns > *last_ns_) {
      last_ns_ = t_ns;
      in_a_row_ = 0;
      return Order::later;
    }
    if (t_ns == *last_ns_) return Order::duplicate;
    in_a_row_ = in_a_row_ > 0 && t_ns > earlier_ns_ ? in_a_row_ + 1 : 1;
    earlier_ns_ = t_ns;
    if (in_a_row_ < kSetBack) return Order::earlier;
    last_ns_ = t_ns;
    in_a_row_ = 0;
    return Order::anew;
  }

 private:
  static constexpr int kSetBack = 5;

  std::optional<TimeNs> last_ns_;
  TimeNs earlier_ns_ = 0;  ///< the last that was left out
  int in_a_row_ = 0;       ///< of these
};

}  // namespace ear::ros2
