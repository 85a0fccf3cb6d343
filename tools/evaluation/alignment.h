// The motion that puts an estimate's world onto the truth's. Formulas: docs/evaluation.md, "Alignment".
#pragma once

#include <Eigen/Geometry>

#include "tools/evaluation/trajectory.h"

namespace ear::evaluation {

/// What an estimate's world may differ in from the truth's.
enum class AlignmentKind {
  se3,  ///< rotation and translation
  yaw,  ///< rotation about the vertical and translation
  none  ///< nothing
};

struct Alignment {
  Eigen::Isometry3d T_TE = Eigen::Isometry3d::Identity();  ///< estimate's world E to truth's world T
  bool rotation_from_attitude = false;  ///< the positions did not spread far enough to tell the rotation
};

/// Least squares over all poses; both have the same length and are not empty. The rotation comes from the positions
/// (Umeyama without scale; for yaw its planar form). Where these spread less than 0.1 m in the directions that tell the
/// rotation, it comes from the attitudes: standing still must not turn noise into a rotation. Where the truth has no
/// attitudes, it comes from the positions all the same.
[[nodiscard]] Alignment align(AlignmentKind kind, const Trajectory& estimate, const Trajectory& truth,
                              bool has_attitude = true);

/// The rotation about the vertical alone, from attitudes or from positions.
[[nodiscard]] Eigen::Matrix3d yaw_from_attitudes(const Trajectory& estimate, const Trajectory& truth);
[[nodiscard]] Eigen::Matrix3d yaw_from_positions(const Trajectory& estimate, const Trajectory& truth);

/// The motion with this rotation that moves the estimate's mean position onto the truth's.
[[nodiscard]] Eigen::Isometry3d around_centre(const Eigen::Matrix3d& R_TE, const Trajectory& estimate,
                                              const Trajectory& truth);

/// Moves one pose onto the other: all of it (se3), or its position and its yaw in the sense that the rotation error
/// about the vertical becomes zero (yaw, none).
[[nodiscard]] Eigen::Isometry3d align_pose(AlignmentKind kind, const Pose& estimate, const Pose& truth);

}  // namespace ear::evaluation
