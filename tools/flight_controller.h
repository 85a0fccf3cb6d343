// A replay that tells a flight controller, in real time, what the estimator finds (docs/mavlink.md).
#pragma once

#include <string>
#include <vector>

#include "ear/odometry.h"
#include "src/live/mavlink_output.h"
#include "src/mavlink/link.h"
#include "src/recording/recording.h"
#include "tools/real_time.h"
#include "tools/replay.h"

namespace CLI {  // NOLINT(readability-identifier-naming): the library's name
class App;
}

namespace ear::tools {

struct FlightControllerArguments {
  std::string address;  ///< see mavlink::Transport; empty: no flight controller
  std::vector<double>
      mounting_deg;  ///< roll, pitch, yaw of the IMU in the vehicle; empty: the odometer's axes are used
  int system = 1;
};

void add_options(CLI::App& command, FlightControllerArguments& args);

class FlightController {
 public:
  /// Opens the line; the clock starts with the recording's `first_ns`. Throws InputError if it is not known how the IMU
  /// sits in the vehicle.
  FlightController(const FlightControllerArguments& args, const Calibration& calibration, TimeNs first_ns);

  /// Call before each sample is handed to `odometry`: waits until it is time for it.
  void before_sample(const Sample& sample, const Odometry& odometry);

  /// Call with the outcome of each frame.
  void after_frame(const ReplayedFrame& frame, const Odometry& odometry);

  /// One line about the conversation.
  [[nodiscard]] std::string report() const;

 private:
  Eigen::Matrix3d R_BV_;  ///< first: where it is not known, no line is opened
  RealTimeClock clock_;
  mavlink::Link link_;  ///< its thread reads the clock
  live::MavlinkOutput output_;
  std::optional<TimeNs> last_imu_ns_;
};

}  // namespace ear::tools
