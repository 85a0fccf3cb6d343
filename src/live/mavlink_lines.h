// The lines to flight controllers and microcontrollers that a configuration names.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "src/live/live_settings.h"
#include "src/live/mavlink_output.h"

namespace ear::live {

/// A line's thread runs as long as this lives.
class MavlinkLines {
 public:
  /// Opens all of them. `intake` must outlive it. Throws InputError, std::invalid_argument as MavlinkSensors, and
  /// std::runtime_error where a line cannot be opened.
  MavlinkLines(const std::vector<MavlinkSettings>& settings, Intake& intake);

  /// By the estimator's thread.
  void take(const LiveSample& sample);
  void take(const LiveFrame& frame);
  /// By another thread, a few times a second: what changed, in words.
  [[nodiscard]] std::vector<std::string> look();

 private:
  struct Line {
    std::unique_ptr<MavlinkSensors> sensors;
    std::unique_ptr<MavlinkOutput> output;
    std::unique_ptr<mavlink::Link> link;
  };

  std::vector<Line> lines_;
};

}  // namespace ear::live
