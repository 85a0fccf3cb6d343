// What the estimator reports of itself and of its sensors: can a flight controller act on the estimate, and which
// sensors is it not based on? Meanings, thresholds and times: docs/health.md.
#pragma once

#include <array>
#include <bitset>
#include <cstddef>
#include <cstdint>

#include "ear/types.h"

namespace ear {

enum class HealthStatus : std::uint8_t {
  initialising,  ///< there was no estimate yet
  tracking,      ///< no sensor is faulty; some may be rightly silent, as wheels are in flight
  degraded,      ///< the estimate may be used, but rests on fewer sensors than it should, is imprecise, or misaligned
  lost           ///< there was an estimate; now it may be anywhere, and none is given
};

/// Why there is no estimate.
enum class Reason : std::uint8_t {
  none,  ///< there is one
  // What a start waits for, the first one or another after `lost`.
  no_frame,       ///< neither an image came nor a step was asked for, that inertial samples reach
  few_samples,    ///< inertial samples are missing
  other_gravity,  ///< it stands, but the mean specific force is not gravity: another unit, or a broken sensor
  // It does not stand still, and
  moves_unseen,        ///< nothing shows how far it moves: see docs/health.md
  few_readings,        ///< the wheels' readings do not yet span the time that a start takes
  wheel_gaps,          ///< the wheels' readings are missing, or more than 0.5 s apart (0.25 s where counts wrap)
  wheels_contradict,   ///< wheels and inertial samples show different motions, as with slip
  few_frames,          ///< the frames whose features fit each other do not yet span the time for a start
  cameras_contradict,  ///< cameras and inertial samples show different motions
  // A start was given, and
  start_is_ahead,  ///< its time is not yet there
  start_is_past,   ///< the inertial samples do not reach back to it
  // It has started, and
  vague_velocity,  ///< the velocity is not known well enough yet
  // How it was lost.
  inertia_alone,      ///< nothing but inertial samples for two seconds
  velocity_lost,      ///< the velocity's standard deviation is too large
  images_contradict,  ///< for a second, images do not show what the state expects, and no wheels agree with it
  not_a_number,       ///< the state or its covariance is not finite or cannot be: a negative variance, too far away
  clock_or_gap,       ///< two seconds without inertial samples, or their clock was set back
  proving             ///< what is measured fits again, but not yet for half a second
};

/// What can be wrong by itself.
enum class Source : std::uint8_t {
  camera_left,
  camera_right,
  wheel_left,
  wheel_right,
  beam_0,  ///< lasers in the order of LaserCalibration::beams
  beam_1,
  beam_2,
  gyroscope,
  accelerometer
};
inline constexpr std::size_t kSourceCount = 9;
using SourceSet = std::bitset<kSourceCount>;  ///< by Source

[[nodiscard]] constexpr std::size_t index_of(Source source) { return static_cast<std::size_t>(source); }
[[nodiscard]] constexpr Source beam_source(std::size_t beam) {
  return static_cast<Source>(index_of(Source::beam_0) + beam);
}

inline constexpr std::array<const char*, kSourceCount> kSourceNames{"camera_left", "camera_right", "wheel_left",
                                                                    "wheel_right", "beam_0",       "beam_1",
                                                                    "beam_2",      "gyroscope",    "accelerometer"};

/// What carries the estimate, besides the inertial sensors.
enum class Aiding : std::uint8_t { none, standing, wheels, cameras, cameras_and_wheels };

/// The last measurement of one source, against what was expected. Cameras: root mean square over the features tested
/// [px]; wheels: speed over the ground [m/s]; beams: range [m]; gyroscope: how much faster the cameras turned, mean of
/// half a second [rad/s]. The accelerometer, which nothing predicts, has a score only.
struct SourceRecord {
  double innovation = 0.0;  ///< measured - predicted
  double variance = 0.0;    ///< of the innovation, as expected
  double gate_ratio = 0.0;  ///< squared Mahalanobis distance over its threshold: more than 1 does not fit
  int used = 0;             ///< measurements that fitted since the frame before
  int rejected = 0;         ///< measurements that did not
  TimeNs last_used_ns = 0;  ///< when one fitted last (IMU time); 0: never
  /// Consistency score, in (0, 1]: at the last update the standard deviation of its noise was that of the settings and
  /// the calibration over this; the weight (15) is part of it. docs/health.md.
  double score = 1.0;
};

struct Health {
  HealthStatus status = HealthStatus::initialising;
  Reason reason = Reason::no_frame;  ///< why there is no estimate: what a start waits for, or how it was lost
  TimeNs since_ns = 0;               ///< when the status began (IMU time)
  SourceSet faulty;                  ///< sources that the estimate should rest on, and does not
  std::array<TimeNs, kSourceCount> onset_ns{};  ///< of these: since when
  bool imprecise = false;          ///< two standard deviations of the position are more than 5 % of the path and 0.1 m
  bool misaligned = false;         ///< sensors point elsewhere in the body than the calibration allows
  Aiding aiding = Aiding::none;    ///< what is left
  int quality = 0;                 ///< 0 (lost) ... 100
  double horizontal_sigma = 0.0;   ///< [m] standard deviation of the position since the start, in the worst direction
  double vertical_sigma = 0.0;     ///< [m]
  std::uint8_t reset_counter = 0;  ///< grows when the pose goes on with a jump: after `lost`
  int load_step = 0;               ///< how much work is left out to keep PerformanceConfig::budget_ms; 0: none
  std::array<SourceRecord, kSourceCount> sources{};
};

}  // namespace ear
