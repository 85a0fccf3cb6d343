// Whether a stamp can be used. One false stamp must not shut out the samples that follow it.
#pragma once

#include <algorithm>
#include <cstdint>

#include "ear/types.h"

namespace ear {

/// [s] chosen: samples that do not come for so long are missing, and the stamp that follows needs to be confirmed.
inline constexpr double kStreamGap = 0.25;
/// [s] chosen: what a sensor showed so long ago shows nothing of now.
inline constexpr double kStale = 0.5;
/// [s] chosen: without inertial samples, or with nothing but these, for so long, and the state is lost.
inline constexpr double kLostAfter = 2.0;
/// Chosen: so many samples in a row confirm each other; one may have a false stamp.
inline constexpr int kConfirmed = 3;
/// Chosen: one sample may be lost; so many of the usual intervals are a gap.
inline constexpr double kMissed = 2.5;
inline constexpr double kSilent = 0.12;  ///< [s] chosen: but not less than this

/// How long a sensor may be silent [s] that usually delivers every `interval` seconds; 0: not known.
[[nodiscard]] inline double longest_silence(double interval) { return std::max(kSilent, kMissed * interval); }

[[nodiscard]] constexpr bool is_time(TimeNs t_ns) { return t_ns > -kLargestStamp && t_ns < kLargestStamp; }

enum class Stamp : std::uint8_t {
  next,       ///< follows the one before
  after_gap,  ///< the stream returns: a step ahead that further stamps have confirmed
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

 private:
  bool any_ = false;
  TimeNs last_ns_ = 0;      ///< of those accepted
  TimeNs run_from_ns_ = 0;  ///< stamps in a row that follow each other, but not last_ns_: the first
  TimeNs run_to_ns_ = 0;    ///< and the last
  int run_ = 0;             ///< how many
  TimeNs clock_shift_ = 0;
};

}  // namespace ear
