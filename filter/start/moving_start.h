// Where a filter may begin in a vehicle that moves, in the air or without wheels: velocity, gravity and biases that
// explain what the cameras and the inertial samples saw over the last second or two. docs/filter.md, "Starts".
#pragma once

#include <optional>
#include <vector>

#include "ear/filter_config.h"
#include "ear/types.h"
#include "filter/ekf/state.h"
#include "filter/ingest/imu_buffer.h"
#include "filter/sources/cameras/stereo_motion.h"
#include "filter/start/single_camera_start.h"

namespace ear {

/// [s] chosen: of what a start in motion takes.
inline constexpr double kStartSpan = 1.5;

/// Keeps the frames of the last seconds, and how the vehicle moved between them.
class MovingStart {
 public:
  MovingStart(const FilterConfig& config, const Calibration& calibration);

  struct TimedFrame {
    TimeNs t_ns = 0;  ///< IMU time
    FeatureFrame features;
    StereoMotion motion;  ///< from the frame before; unused for the first, and with one camera
  };

  /// The next frame, at IMU time `t_ns`. Where its motion is not known, what came before is forgotten.
  void add(TimeNs t_ns, const FeatureFrame& frame, const ImuBuffer& imu, const CameraState& cameras);

  /// Are the frames kept enough for solve(), from this one on?
  [[nodiscard]] bool spans_enough(std::size_t first = 0) const;

  /// A state at the first frame kept; none while the frames span too little, or contradict the inertial samples. With
  /// two cameras least squares over the velocity v and gravity g of that moment, in the body as it then was (B), and
  /// the biases:
  ///   p_k+1 - p_k = v dt + g (t_k+1^2 - t_k^2) / 2 + double integral of R f          p_k: from the cameras
  /// It is a point to linearize at, not an estimate: the frames may be used again. With one camera, which costs more,
  /// by single_camera_start(), five times a second.
  [[nodiscard]] StartAttempt solve(const ImuBuffer& imu, const CameraState& cameras);

  /// The path from the last frame to IMU time `t_ns`, in the body as it was then, at the speed before. Nothing before
  /// two frames.
  [[nodiscard]] std::optional<Eigen::Vector3d> path_to(TimeNs t_ns) const;

  [[nodiscard]] const std::vector<TimedFrame>& frames() const { return frames_; }
  void clear() { frames_.clear(); }

 private:
  [[nodiscard]] StartAttempt by_two_cameras(const ImuBuffer& imu) const;
  [[nodiscard]] StartFit fit_to_motions(const Eigen::Vector3d& b_g, const ImuBuffer& imu) const;

  StartNoise noise_;
  bool stereo_;
  std::vector<TimedFrame> frames_;  ///< oldest first
  StereoMatches matches_;
  std::optional<TimeNs> tried_ns_;  ///< with one camera, the last time
  Reason lacked_ = Reason::none;    ///< then
};

}  // namespace ear
