// What the inertial samples leave unknown: gaps in them, and samples that may be off by more than noise (clipped).
// Until two images bridge it, the state may be too far off to be linear. docs/filter.md, "Gaps and jumps".
#pragma once

#include <optional>

#include "ear/types.h"

namespace ear {

class ImuInterruption {
 public:
  /// What is not known of a gap, standard deviations [s].
  struct Unseen {
    double time = 0.0;        ///< how long it took: samples may be lost, or the clock jumped
    double unmeasured = 0.0;  ///< how long nothing was measured that could be used
  };

  /// No samples between these stamps.
  void add_gap(TimeNs from_ns, TimeNs to_ns, const Unseen& unseen);
  /// A sample at that time may be off by more than noise.
  void add_uncertain(TimeNs t_ns);
  /// Two images have shown the motion, up to that time.
  void set_bridged(TimeNs t_ns) { bridged_ns_ = t_ns; }

  /// As far as the state, which has come to `t_ns`, does not know of it yet.
  [[nodiscard]] Unseen take_unseen(TimeNs t_ns);
  /// Is there anything to bridge? Asked once a frame, which then is past.
  [[nodiscard]] bool take_uncertain();
  /// With an attitude that may be some degrees off, wheels and lasers would be linearised in the wrong place: the next
  /// image comes first, if there is one soon, and some time until its features add more.
  [[nodiscard]] bool waits_for_images(TimeNs t_ns) const;

 private:
  struct Gap {
    TimeNs from_ns = 0;
    TimeNs to_ns = 0;  ///< at once, if the clock jumped back
    Unseen unseen;
    double counted = 0.0;  ///< share of it that the covariance knows of
  };

  std::optional<Gap> gap_;  ///< ahead of the state, or around it
  std::optional<TimeNs> uncertain_since_ns_;
  std::optional<TimeNs> bridged_ns_;
};

}  // namespace ear
