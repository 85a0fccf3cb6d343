// The clock of a flight controller in ours, from answers to TIMESYNC requests.
#pragma once

#include <cstdint>
#include <optional>

#include "ear/types.h"

namespace ear::mavlink {

/// Offset and drift of another clock, by an alpha-beta filter of exchanges that took no longer than usual. Its time
/// comes with the data.
class ClockSync {
 public:
  /// An answer came at `now_ns` to a request of `sent_ns` (ours); `remote_ns` is the other clock when it answered.
  void add(TimeNs sent_ns, TimeNs remote_ns, TimeNs now_ns);

  /// Enough answers came for stamps to be used.
  [[nodiscard]] bool ready() const { return used_ >= kFewest; }
  /// The other clock's stamp in our clock; nothing until ready().
  [[nodiscard]] std::optional<TimeNs> to_ours(TimeNs remote_ns) const;
  /// How often the other clock was set, as by a restart; then it begins anew.
  [[nodiscard]] std::uint64_t steps() const { return steps_; }
  /// Of the exchanges that count [s].
  [[nodiscard]] double round_trip() const { return round_trip_; }

  static constexpr int kFewest = 10;

 private:
  void restart();
  void correct(double innovation, double dt);

  double round_trip_ = 0.0;  ///< [s] of the quickest exchanges, forgotten slowly
  TimeNs offset_ns_ = 0;     ///< other - ours at `at_ns_`
  double drift_ = 0.0;       ///< [s/s] of the offset
  TimeNs at_ns_ = 0;         ///< ours
  int used_ = 0;             ///< exchanges, since the start or the last step
  int far_off_ = 0;          ///< exchanges in a row that contradict the offset
  std::uint64_t steps_ = 0;
};

}  // namespace ear::mavlink
