// The front end: images in, tracks of normalized points out. It does not know that a filter exists.
#pragma once

#include <Eigen/Core>
#include <array>
#include <memory>
#include <vector>

#include "ear/calibration.h"
#include "ear/frontend_config.h"
#include "ear/types.h"

namespace ear {

/// How the body is thought to have moved from the last frame (B0) to this one (B1), from IMU and odometer. A rotation
/// that is not known (to about a pixel) still says where to search, but flows are not judged by it.
struct MotionPrediction {
  Eigen::Matrix3d R_B1B0 = Eigen::Matrix3d::Identity();
  Eigen::Vector3d p_B0B1 = Eigen::Vector3d::Zero();  ///< position of B1 in B0 [m]
  bool rotation_known = false;
  bool translation_known = false;
};

/// Wall-clock time spent in each step of the last frame [s]. `detect` includes the first stereo search of new features.
struct FrontendTiming {
  double pyramid = 0.0, track = 0.0, detect = 0.0, stereo = 0.0, reject = 0.0;
};

/// Runs on the calling thread.
class Frontend {
 public:
  /// Throws std::invalid_argument if there is no camera or a calibration is unusable.
  Frontend(const FrontendConfig& config, std::vector<CameraCalibration> cameras);
  ~Frontend();
  Frontend(Frontend&&) noexcept;
  Frontend& operator=(Frontend&&) noexcept;

  /// Tracks the last frame's features into this one, associates them across the stereo pair, fills up with new ones.
  /// A left image that is byte for byte the one before gives its features again, as they were, marked as
  /// FeatureFrame::repeated. The result is valid until the next call. A
  /// frame whose images do not fit the calibration throws std::invalid_argument.
  const FeatureFrame& process(const StereoFrame& frame, const MotionPrediction& prediction);

  [[nodiscard]] const FrontendTiming& timing() const;

  /// From the next frame on: so many tracks at a time, up to FrontendConfig::max_features, and whether the right image
  /// is looked at. Of too many tracks the youngest end.
  void set_limits(int max_features, bool use_right);

  /// Forgets all tracks; ids go on counting.
  void reset();

 private:
  class Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace ear
