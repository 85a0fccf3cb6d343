// What an embedding program includes: samples in, estimates out.
//
//   ear::Odometry odometry(ear::Config{}, calibration);
//   odometry.add_imu(sample);                              // as they arrive, in time order
//   if (const auto estimate = odometry.add_stereo(frame))  // once per frame
//     use(estimate->p_WB, estimate->covariance);
//
// Samples -> sensor buffer -> front end -> filter -> Estimate. Single-threaded: one thread calls at a time.
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <cstdint>
#include <memory>
#include <optional>

#include "ear/calibration.h"
#include "ear/config.h"
#include "ear/types.h"

namespace ear {

/// Where the estimator is in its life.
enum class Status : std::uint8_t {
  waiting_for_imu,         ///< too few inertial samples yet
  waiting_for_standstill,  ///< it starts from standing, and the vehicle moves
  tracking
};

/// Order of the error vector of Estimate::covariance, 3 components each. Ordinary errors, not the filter's own:
/// R_true = Exp(rotation) R_WB with the axes of the world; all others true minus estimated, in the field's own frame.
namespace estimate_error {
inline constexpr int rotation = 0, velocity = 3, position = 6, gyro_bias = 9, accel_bias = 12, size = 15;
}

/// The state of the vehicle at one instant. World W: z up, origin and yaw at the first pose. Body B: the IMU.
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
  int tracks = 0;             ///< features seen in this frame
  int stereo = 0;             ///< of these, seen by both cameras
  int features_used = 0;      ///< tracks that updated the filter
  int features_rejected = 0;  ///< tracks that failed triangulation or the gate
  int clones = 0;             ///< clones in the window
  bool standing = false;      ///< the vehicle was held by a standstill update
};

struct Estimate {
  NavState state;
  Eigen::Matrix<double, estimate_error::size, estimate_error::size> covariance;  ///< see estimate_error
  FrameStatistics frame;
};

/// What was refused or bridged since the start; nothing is lost silently.
struct InputCounts {
  std::uint64_t imu_rejected = 0;        ///< not finite, or not later than the sample before
  std::uint64_t imu_gaps = 0;            ///< holes longer than FilterConfig::max_imu_gap
  std::uint64_t frames_rejected = 0;     ///< not later than the frame before, or images that do not fit the calibration
  std::uint64_t frames_without_imu = 0;  ///< no inertial samples reach the frame's time
};

/// Time spent in the last add_stereo [s].
struct StageTimes {
  double pyramid = 0.0, track = 0.0, detect = 0.0, stereo = 0.0, reject = 0.0, filter = 0.0;
};

class Odometry {
 public:
  /// Throws std::invalid_argument, naming the field, if the calibration or a setting is unusable.
  Odometry(const Config& config, const Calibration& calibration);
  ~Odometry();
  Odometry(Odometry&&) noexcept;
  Odometry& operator=(Odometry&&) noexcept;

  void add_imu(const ImuSample& sample);

  /// The estimate at the frame's time, or nothing while the estimator cannot start (see status()). Inertial samples up
  /// to the frame's time should be there; where the last ones are missing, the newest one is held.
  std::optional<Estimate> add_stereo(const StereoFrame& frame);

  /// The newest state, carried on by the inertial samples that came since. Nothing before the start.
  [[nodiscard]] std::optional<NavState> predict(TimeNs t_ns) const;

  [[nodiscard]] Status status() const;
  [[nodiscard]] InputCounts input_counts() const;
  [[nodiscard]] StageTimes stage_times() const;

  /// The calibration in use: what was given, with what was learned while running.
  [[nodiscard]] Calibration calibration() const;

  /// Back to the state after construction.
  void reset();

 private:
  class Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace ear
