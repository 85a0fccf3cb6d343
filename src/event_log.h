// What class Odometry logs: when its state of health changes, and what it does not use.
#pragma once

#include <map>
#include <string>

#include "ear/estimate.h"
#include "src/log/repeat_limit.h"

namespace ear {

/// Looks on after each frame and step, and writes what changed to the log (src/log/log.h). What repeats is written
/// every ten seconds of the samples' time.
class EventLog {
 public:
  /// `t_ns`: the frame's or step's time.
  void note(TimeNs t_ns, const Health& health, const InputCounts& counts);

  /// The images of a frame could not be used.
  void note_unusable(TimeNs t_ns, const std::string& reason);

 private:
  void note_health(TimeNs t_ns, const Health& health);
  void note_refused(TimeNs t_ns, const char* stream, const StreamCounts& before, const StreamCounts& now);
  void warn(TimeNs t_ns, const std::string& kind, const std::string& message);

  static constexpr double kInterval = 10.0;  // [s]

  Health written_;
  std::map<std::string, TimeNs> states_;  // when each was written last
  InputCounts counts_;
  RepeatLimit limit_{kInterval};
};

}  // namespace ear
