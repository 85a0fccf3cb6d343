// How the body moved between two frames, from the features that both cameras saw in the first: no filter, no window.
// docs/filter.md, "Starts".
#pragma once

#include <Eigen/Core>
#include <optional>
#include <vector>

#include "ear/kernels.h"
#include "ear/types.h"
#include "filter/ekf/covariance.h"
#include "filter/ekf/state.h"

namespace ear {

/// A feature seen in two frames. What stands before the number of the frame is normalized.
struct StereoMatch {
  Eigen::Vector2d left0, right0;  ///< in frame 0
  Eigen::Vector2d left1, right1;  ///< in frame 1
  bool has_right1 = false;
};

/// Finds the features with an observation in both cameras of one frame, and in the left one of another.
class StereoMatches {
 public:
  StereoMatches();

  /// The features of both frames, what is known of the lenses' errors taken out, and of both right observations what
  /// keeps the right one of frame 0 off its epipolar line: a right camera that is not quite where the calibration says
  /// else looks like a turn from each frame to the next. Valid until the next call.
  const std::vector<StereoMatch>& find(const FeatureFrame& from, const FeatureFrame& to, const CameraState& cameras);
  [[nodiscard]] const std::vector<StereoMatch>& found() const { return matches_; }

 private:
  std::vector<const FeatureObservation*> earlier_;  ///< those of `from`, by id
  std::vector<StereoMatch> matches_;
};

/// Depth along the ray of the left camera: least squares over the right one, linear. Inverse [1/m]; negative where the
/// images contradict the cameras' geometry.
[[nodiscard]] double stereo_inverse_depth(const CameraState& cameras, const Eigen::Vector2d& left,
                                          const Eigen::Vector2d& right);
/// Its standard deviation [1/m]. `sigma`: of one observation, normalized.
[[nodiscard]] double stereo_inverse_depth_sigma(const CameraState& cameras, double sigma);

/// [standard deviations] chosen: from where an observation weighs less.
inline constexpr double kHuber = 2.0;
/// [rad] chosen: standard deviation of a turn between two images, besides the fit's.
inline constexpr double kSeenTurn = 2e-3;

/// The motion from frame 0 to frame 1.
struct StereoMotion {
  Pose T_B0B1;
  /// Of a turn in B1 [rad], and of p_B0B1 [m].
  Eigen::Matrix<double, 6, 6> covariance = Eigen::Matrix<double, 6, 6>::Identity();
  int matches = 0;
  int fitting = 0;  ///< of these

  [[nodiscard]] Eigen::Matrix3d p_covariance() const { return covariance.bottomRightCorner<3, 3>(); }
};

/// By how much the body turned [rad], in B1, or moved [m], in B0, more than predicted.
struct Excess {
  Eigen::Vector3d value = Eigen::Vector3d::Zero();
  Eigen::Matrix3d covariance = Eigen::Matrix3d::Identity();
  Eigen::Matrix3d by_prediction = Eigen::Matrix3d::Zero();  ///< its part by what was predicted, which frames may share
  Eigen::Vector3d explained = Eigen::Vector3d::Zero();      ///< what more there would be if nothing were predicted
};
/// What the images show of the turn if the displacement is as predicted, to within `p_covariance`. Alone, a fit takes
/// some of the displacement for a turn, since the depths are noisy.
[[nodiscard]] Excess turn_beyond(const StereoMotion& seen, const Pose& T_B0B1, const Eigen::Matrix3d& p_covariance);
/// The same of the displacement if the turn is as predicted, each axis to within `turn_variance`.
[[nodiscard]] Excess way_beyond(const StereoMotion& seen, const Pose& T_B0B1, double turn_variance);
/// What errors of the cameras' mounting, focal length and time offset make look like an excess: its variance, of a rate
/// or acceleration `motion` that changes by `change` a second. `P`: of the state's error.
[[nodiscard]] double apparent_variance(const Covariance& P, const Eigen::Vector3d& motion,
                                       const Eigen::Vector3d& change);
/// The same of a turn [rad/s], with what the gyroscope's scales and axes add.
[[nodiscard]] double apparent_turn_variance(const Covariance& P, const Eigen::Vector3d& rate_B,
                                            const Eigen::Vector3d& change);
/// Does a frame follow the last one at once, `dt` before [s], if the motion since that took `duration`?
[[nodiscard]] bool follows(double dt, double duration);

/// Least squares over rotation and translation: the points seen in frame 0, projected into both cameras of frame 1.
/// Observations further off than `huber` standard deviations weigh less. `sigma`: one observation, normalized; `start`:
/// where to begin, `settled` [rad, m]: steps with which it ends. Nothing if the points do not show it, most of them do
/// not move as one body, or the steps do not end.
[[nodiscard]] std::optional<StereoMotion> stereo_motion(const std::vector<StereoMatch>& matches,
                                                        const CameraState& cameras, const Pose& start, double sigma,
                                                        double settled = 1e-8, Kernels kernels = Kernels::best);

}  // namespace ear
