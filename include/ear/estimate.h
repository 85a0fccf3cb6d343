// What the estimator reports: the state with its covariance, what each frame was used for, how far the sensors
// agree, and what was refused.
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>

#include "ear/health.h"
#include "ear/types.h"

namespace ear {

/// Where the estimator is in its life.
enum class Status : std::uint8_t {
  waiting_for_imu,         ///< too few inertial samples yet
  waiting_for_standstill,  ///< it cannot start yet; Health::reason says why
  tracking,
  lost  ///< there was an estimate; it may be anywhere now (Health::status), and starts again as it can
};

/// Order of the error vector of Estimate::covariance, 3 components each. Ordinary errors, not the filter's own:
/// R_true = Exp(rotation) R_WB with the axes of the world; all others true minus estimated, in the field's own frame.
namespace estimate_error {
inline constexpr int rotation = 0, velocity = 3, position = 6, gyro_bias = 9, accel_bias = 12, size = 15;
}

/// The state of the vehicle at one instant. World W: z up, origin and yaw at the first pose, unless the start was given
/// (GivenStart). Body B: the IMU.
struct NavState {
  TimeNs t_ns = 0;
  Eigen::Quaterniond q_WB = Eigen::Quaterniond::Identity();
  Eigen::Vector3d p_WB = Eigen::Vector3d::Zero();  ///< [m]
  Eigen::Vector3d v_W = Eigen::Vector3d::Zero();   ///< [m/s]
  Eigen::Vector3d b_g = Eigen::Vector3d::Zero();   ///< gyroscope bias [rad/s]
  Eigen::Vector3d b_a = Eigen::Vector3d::Zero();   ///< accelerometer bias [m/s^2]
};

/// How the last frame was used.
struct FrameStatistics {
  int tracks = 0;               ///< features seen in this frame
  int stereo = 0;               ///< of these, seen by both cameras
  int features_used = 0;        ///< tracks that updated the filter
  int features_rejected = 0;    ///< tracks that failed triangulation or the gate
  int clones = 0;               ///< clones in the window
  int wheel_rows_used = 0;      ///< rows of the odometer since the frame before that fit, by their scores
  int wheel_rows_rejected = 0;  ///< those that do not; they update the filter with less weight
  int beams_used = 0;           ///< laser ranges since the frame before that passed the gate
  int beams_rejected = 0;       ///< those that failed it; they update the filter with less weight
  bool standing = false;        ///< the vehicle was held by a standstill update
  bool on_ground = false;       ///< the wheels carry the vehicle
};

/// The ground under the vehicle, on a vehicle with wheels and lasers.
struct TerrainEstimate {
  bool known = false;         ///< false in the air, without lasers, and before they saw it
  double slope_along = 0.0;   ///< in driving direction, uphill positive [rad]
  double slope_across = 0.0;  ///< to its left, uphill positive [rad]
  double sigma_along = 0.0;   ///< standard deviation [rad]
  double sigma_across = 0.0;  ///< [rad]
};

/// The sensors that each measure how far the body moved.
enum class MotionSensor : std::uint8_t { imu, odometer, camera };
inline constexpr std::size_t kMotionSensors = 3;

/// How far the sensors agree on the path since the frame before: the paper's (13)-(15); docs/anomaly.md. Arrays are
/// in the order of MotionSensor; coefficients, score and threshold have the unit of AnomalyConfig::score.
struct Consistency {
  std::array<bool, kMotionSensors> available{};      ///< which measured a displacement
  std::array<double, kMotionSensors> coefficient{};  ///< how far each is from the others, (14)
  std::array<double, kMotionSensors> weight{};       ///< (15): from 1, as it is, to 0, not used
  double variance = 0.0;                             ///< of the displacements, (13) [m^2]
  double score = 0.0;                                ///< above the threshold they disagree
  double threshold = 0.0;
  std::optional<MotionSensor> anomalous;  ///< the faulty one; empty where two disagree, as it may be either

  [[nodiscard]] bool disagree() const { return score > threshold; }
};

struct Estimate {
  NavState state;
  Eigen::Matrix<double, estimate_error::size, estimate_error::size> covariance;  ///< see estimate_error
  TerrainEstimate terrain;
  FrameStatistics frame;
  Consistency consistency;
  Health health;
};

/// What one stream delivered. Every sample is counted once: as accepted, or by the reason why it was refused.
struct StreamCounts {
  std::uint64_t accepted = 0;
  std::uint64_t not_finite = 0;   ///< NaN or infinite; a laser beam's NaN is no return, and none of these
  std::uint64_t implausible = 0;  ///< no sensor measures it: wrong unit, broken message, images that do not fit
  std::uint64_t not_later = 0;    ///< a duplicate, or earlier than the sample before
  std::uint64_t far_ahead = 0;    ///< a stamp far ahead of the others that nothing confirms
  std::uint64_t too_late = 0;     ///< so far behind the state that it cannot be used any more
  std::uint64_t repeated = 0;  ///< the last sample again, more often in a row than by chance: the driver has no new one
  std::uint64_t gaps = 0;      ///< gaps in what was accepted; not a refusal

  [[nodiscard]] std::uint64_t rejected() const {
    return not_finite + implausible + not_later + far_ahead + too_late + repeated;
  }
};

/// What was refused or bridged since the start: no sample is dropped without being counted. How far the samples
/// accepted agree with the state is in Health::sources.
struct InputCounts {
  StreamCounts imu;                     ///< gaps: longer than 2.5 of the usual intervals
  StreamCounts encoder;                 ///< gaps: longer than 0.25 s
  StreamCounts laser;                   ///< gaps: longer than 0.25 s
  StreamCounts camera;                  ///< frames; far_ahead: ahead of the inertial samples; gaps: longer than 0.25 s
  std::uint64_t imu_spikes = 0;         ///< of one to five samples, crossed by a line
  std::uint64_t clock_jumps = 0;        ///< of one sensor's clock against all others, which were taken out
  std::uint64_t features_rejected = 0;  ///< not finite, in no image that there is, or twice in a frame
  std::uint64_t steps_rejected = 0;     ///< calls of Odometry::step for a time not later than the state, or without IMU
};

/// Time spent in the last add_stereo [s].
struct StageTimes {
  double pyramid = 0.0, track = 0.0, detect = 0.0, stereo = 0.0, reject = 0.0, filter = 0.0;
};

}  // namespace ear
