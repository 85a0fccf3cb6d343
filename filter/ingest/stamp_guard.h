// Whether a stamp can be used. One false stamp must not shut out the samples that follow it.
#pragma once

#include <cstdint>
#include <optional>

#include "ear/types.h"

namespace ear {

enum class Stamp : std::uint8_t {
  next,       ///< follows the one before, or a step ahead that further stamps have confirmed
  set_back,   ///< the clock was set back: stamps have gone on from an earlier time for a second
  not_later,  ///< refused: a duplicate, or earlier
  far_ahead   ///< refused: a step ahead that nothing confirms yet
};

/// The stamps of the inertial samples, which are the filter's clock.
class StampGuard {
 public:
  /// `t_ns` must be a time.
  [[nodiscard]] Stamp judge(TimeNs t_ns);

  /// After set_back: what the earlier stamps are to be moved by to be stamps of the clock as it goes now [ns].
  [[nodiscard]] TimeNs clock_shift() const { return clock_shift_; }
  /// The newest one accepted.
  [[nodiscard]] std::optional<TimeNs> newest() const { return last_ns_; }
  /// Is the last one refused for not being later?
  [[nodiscard]] bool refuses() const { return run_ > 0 && run_to_ns_ <= *last_ns_; }
  /// If so: how long stamps in a row went on meanwhile [s].
  [[nodiscard]] double refused() const { return refuses() ? seconds_between(run_from_ns_, run_to_ns_) : 0.0; }

 private:
  std::optional<TimeNs> last_ns_;
  TimeNs run_from_ns_ = 0;  ///< stamps in a row that follow each other, but not last_ns_: the first
  TimeNs run_to_ns_ = 0;    ///< and the last
  int run_ = 0;             ///< how many
  TimeNs clock_shift_ = 0;
};

}  // namespace ear
