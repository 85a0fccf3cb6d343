// Whose clock is it that jumps? Where the stamps of the inertial samples jump and those of the other sensors, as they
// come in, do not, it is the inertial clock's fault: its stamps are moved back onto the common clock. Where the others
// jump as well, or went on meanwhile, samples are missing, or time is another for all. docs/ingest.md.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <utility>

#include "ear/types.h"
#include "filter/ingest/ring.h"

namespace ear {

class ImuClock {
 public:
  enum class Stream : std::uint8_t { encoder, laser, camera };

  ImuClock();

  /// A sample as its driver stamped it, in the order of arrival. After a jump samples wait until the other sensors have
  /// shown whose it is, for a quarter of a second at most.
  void add(const ImuSample& sample);
  /// Another sensor's reading came in.
  void observe(Stream stream, TimeNs stamp_ns);

  /// The next sample that does not wait, by the common clock. To be asked until there is none, after add() and
  /// observe().
  [[nodiscard]] std::optional<ImuSample> next();

  /// Did another sensor go on before this sample, which came late? Then time passed, and others were lost.
  [[nodiscard]] bool went_on_before(const ImuSample& sample) const { return went_on_ns_ == sample.t_ns + shift_ns_; }
  [[nodiscard]] bool waiting() const { return waiting_; }
  /// Was a jump taken out since the last call?
  [[nodiscard]] bool take_correction() { return std::exchange(new_correction_, false); }
  /// Those that were not undone.
  [[nodiscard]] int jumps_corrected() const { return corrected_; }

 private:
  /// What is known of another stream; stamps [ns], by its own clock.
  struct Other {
    std::optional<TimeNs> newest_ns;
    std::optional<TimeNs> before_ns;  ///< the newest when the last inertial sample came that followed the one before
    int readings = 0;                 ///< since then
    double ahead = 0.0;               ///< [s] of the inertial samples, usually
  };
  /// A jump that was taken out.
  struct Correction {
    TimeNs t_ns = 0;
    double jump = 0.0;       ///< [s]
    int contradictions = 0;  ///< readings in a row against it
  };

  [[nodiscard]] bool jumps(double step) const;
  [[nodiscard]] bool others_show(double step) const;
  [[nodiscard]] bool others_went_on(double step) const;
  void follow(TimeNs driver_ns);
  [[nodiscard]] TimeNs newest_waiting() const;
  void settle(bool own_clock);
  void review(Other& other, TimeNs stamp_ns);

  std::array<Other, 3> others_;
  Ring<ImuSample> samples_;              ///< not fetched yet, by the driver's clock
  bool waiting_ = false;                 ///< for a verdict
  double jump_ = 0.0;                    ///< [s] what it is about
  int votes_ = 0;                        ///< readings for a jump of the inertial clock, less those against
  TimeNs shift_ns_ = 0;                  ///< driver's clock less the common one
  std::optional<TimeNs> last_ns_;        ///< the newest sample that followed the one before, by the driver's clock
  double interval_ = 0.0;                ///< [s] usual
  std::optional<TimeNs> went_on_ns_;     ///< the last sample before which others went on, by the driver's clock
  std::optional<Correction> uncertain_;  ///< the last one, until it is certain
  int corrected_ = 0;
  bool new_correction_ = false;  ///< since take_correction()
};

}  // namespace ear
