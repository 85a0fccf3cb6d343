// The configuration file of `ear live`: where the sensors are, and who is told. docs/live.md lists its keys.
#pragma once

#include <array>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "ear/config.h"
#include "src/live/mavlink_sensors.h"
#include "src/live/ros_names.h"
#include "src/log/log.h"

namespace ear::live {

/// One MAVLink line.
struct MavlinkSettings {
  std::string address;                                ///< see mavlink::Transport
  int system = 1;                                     ///< of the vehicle
  bool send = true;                                   ///< ODOMETRY and what belongs to it
  std::optional<std::array<double, 3>> mounting_deg;  ///< of the IMU in the vehicle; nothing: the odometer's axes
  MavlinkInputs inputs;
};

/// One or two video devices.
struct CameraSettings {
  std::filesystem::path device;  ///< with `right` empty and two cameras calibrated: both images side by side
  std::filesystem::path right;
  double rate_hz = 30.0;
  double delay = 0.0;  ///< [s] from the middle of the exposure to the driver's stamp
};

/// Topics of ROS 2. Those of the sensors are in the map `topics` (src/ros2/topics.h).
struct RosSettings {
  std::optional<int> domain;  ///< nothing: as ROS_DOMAIN_ID says
  bool publish = true;        ///< odometry and what belongs to it
  RosNames names;
};

struct LiveSettings {
  std::filesystem::path file;                 ///< this configuration's
  std::filesystem::path calibration;          ///< folder with <sensor>/sensor.yaml; empty: not given
  std::vector<std::filesystem::path> kalibr;  ///< camchain and imu.yaml in place of the cameras and the IMU
  Config estimator;                           ///< from the key `settings`
  std::optional<double> budget_ms;            ///< nothing: as default_budget_ms()
  std::size_t frame_slots = 8;                ///< frames that wait for the estimator, at most
  std::vector<MavlinkSettings> mavlink;
  std::optional<CameraSettings> cameras;
  std::optional<RosSettings> ros;
  LogOptions log;
};

/// Throws InputError, naming file, line and key, for a key that does not exist or a value of the wrong type. Paths in
/// it are relative to its folder.
[[nodiscard]] LiveSettings load_live_settings(const std::filesystem::path& file);

/// Most of the time between two frames; 0 without cameras, whose work nothing could leave out.
[[nodiscard]] double default_budget_ms(const Calibration& calibration);

}  // namespace ear::live
