// Inertial samples, wheels and ranges that a flight controller or a microcontroller sends by MAVLink.
#pragma once

#include <atomic>
#include <cstdint>
#include <string>
#include <vector>

#include "src/live/intake.h"
#include "src/mavlink/clock_sync.h"
#include "src/mavlink/packet.h"

namespace ear::live {

/// Which messages become which sensors.
struct MavlinkInputs {
  enum class Imu : std::uint8_t { none, highres, scaled } imu = Imu::none;
  bool wheels = false;           ///< WHEEL_DISTANCE: the first two, left and right
  std::vector<int> range_ids{};  ///< DISTANCE_SENSOR: the id of each beam, in the calibration's order; empty: none

  [[nodiscard]] bool any() const { return imu != Imu::none || wheels || !range_ids.empty(); }
};

/// Stamps are the sender's and become ours by its answers to TIMESYNC; until these suffice, samples are passed over.
/// Axes are those of the message, which the calibration describes.
class MavlinkSensors {
 public:
  /// `intake` must outlive it. Throws std::invalid_argument where wheels or beams are asked for that its calibration
  /// has not.
  MavlinkSensors(MavlinkInputs inputs, Intake& intake);

  /// Each packet of the link, by its thread.
  void take(const mavlink::Packet& packet);

  /// By another thread, a few times a second: what changed, in words.
  [[nodiscard]] std::vector<std::string> look();

 private:
  /// The process's time of a stamp [ns]; nothing where that is not known, or the stamp is of another clock.
  [[nodiscard]] std::optional<TimeNs> our_time(std::int64_t stamp, std::int64_t unit_ns);
  void take(const mavlink::ImuMessage& message);
  void take(const mavlink::WheelDistance& message);
  void take(const mavlink::DistanceSensor& message);
  void take_answer(const mavlink::TimeSync& answer);

  MavlinkInputs inputs_;
  Intake& intake_;
  mavlink::ClockSync clock_;
  QueuedOdometry::Ranges ranges_;  ///< of the beams that came since the last reading was complete
  unsigned beams_seen_ = 0;        ///< bit by bit
  std::atomic<std::uint64_t> without_clock_{0}, other_clock_{0}, clock_steps_{0};
  std::atomic<bool> synchronised_{false};

  bool said_synchronised_ = false;  ///< what follows is of the thread that looks
  std::uint64_t said_without_ = 0, said_other_ = 0, said_steps_ = 0;
};

}  // namespace ear::live
