// How far the body went between two frames, by the stereo features seen in both: the rotation is the gyroscope's,
// the translation a robust least-squares fit to points triangulated in each frame. docs/anomaly.md.
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "ear/types.h"
#include "filter/ekf/displacement.h"
#include "filter/ekf/state.h"

namespace ear {

/// A feature's position as one frame shows it.
struct StereoPoint {
  std::uint64_t id = 0;
  bool usable = false;                             ///< in front of both cameras, on rays that meet, at a known distance
  Eigen::Vector3d p_BF = Eigen::Vector3d::Zero();  ///< [m]
  Eigen::Matrix3d covariance = Eigen::Matrix3d::Zero();  ///< by the noise of both observations [m^2]
};

/// `sigma`: of an observation, normalized.
[[nodiscard]] StereoPoint stereo_point(const CameraState& camera, const FeatureObservation& feature, double sigma);

class CameraDisplacement {
 public:
  /// `sigma`: of an observation, normalized. `max_features`: more than that are left out.
  CameraDisplacement(double sigma, std::size_t max_features);

  /// The displacement from the frame of the call before to this one. `R_BiBj`: the rotation meanwhile, and
  /// `rotation_variance` that of each of its axes [rad^2]. Not available with too few points, contradictory where too
  /// few agree.
  Displacement add(const FeatureFrame& frame, const CameraState& camera, const Eigen::Matrix3d& R_BiBj,
                   double rotation_variance);

  /// As if no frame had come.
  void clear() { before_.clear(); }

 private:
  /// A feature seen in both frames: where it was, less where the rotation alone puts it.
  struct Pair {
    Eigen::Vector3d p_BiBj;
    Eigen::Matrix3d information;
    Eigen::Vector3d lever_Bi;  ///< from the body to the feature
  };

  void match(const Eigen::Matrix3d& R_BiBj);
  [[nodiscard]] Displacement fit(double rotation_variance) const;

  double sigma_;
  std::vector<StereoPoint> before_, now_;  ///< by id
  std::vector<Pair> pairs_;
};

}  // namespace ear
