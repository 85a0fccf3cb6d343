// How noisy the samples between two images must have been for what these show: of one pair of images, now. What lasts,
// ImuScore learns. docs/filter.md, "Propagation".
#pragma once

#include <Eigen/Core>
#include <optional>

#include "ear/filter_config.h"
#include "ear/types.h"
#include "filter/ingest/imu_buffer.h"

namespace ear {

/// The most that a gyroscope [rad/s] and an accelerometer [m/s^2] may be wrong by: what is more has another cause.
struct ImuLimits {
  double gyro = 0.0, accel = 0.0;
};

/// An accelerometer that nobody calibrated has ten times the prior; a gyroscope's prior has room for that.
[[nodiscard]] ImuLimits imu_limits(const PriorConfig& prior);

class FrameNoise {
 public:
  explicit FrameNoise(const ImuLimits& limits) : limits_(limits) {}

  /// By how much a pair of images shows more than the samples: a turn [rad] or a displacement [m], each axis.
  struct Seen {
    Eigen::Vector3d beyond = Eigen::Vector3d::Zero();
    Eigen::Vector3d others = Eigen::Vector3d::Zero();  ///< its variance by all but the samples' noise
    Eigen::Vector3d noise = Eigen::Vector3d::Ones();   ///< by the samples' noise as it is stated
    double believed = 1.0;                             ///< factor on that noise, by the last moments
  };

  /// Another frame: nothing is known of its samples yet.
  void start_frame() { factors_ = {}; }
  /// The turn over `duration` [s]: by an error of the gyroscope's rate.
  void add_turn(const Seen& turn, double duration);
  /// The displacement over `duration` [s] to a frame at `t_ns`: by a velocity that is off, since displacements agreed
  /// last, by an error of the accelerometer. What has not agreed for kStale has another cause.
  void add_way(const Seen& way, double duration, TimeNs t_ns);

  /// On the stated noise of the samples up to this frame, with which what is seen is a standard deviation, or what an
  /// error of the sensor makes of it is; 1 where noise explains it, or no such error makes so much of it.
  [[nodiscard]] const ImuNoiseFactors& factors() const { return factors_; }

 private:
  ImuLimits limits_;
  ImuNoiseFactors factors_;
  std::optional<TimeNs> agreed_ns_;  ///< a displacement, or noise has explained it
};

}  // namespace ear
