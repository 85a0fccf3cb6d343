// The ground under the vehicle as a plane, and the laser beams that see it. The paper's III-B; docs/filter.md,
// "Ground and beams".
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <optional>
#include <vector>

#include "ear/calibration.h"
#include "filter/ekf/state.h"

namespace ear {

/// A plane in the body frame.
struct GroundPlane {
  Eigen::Vector3d n_B = Eigen::Vector3d::UnitZ();  ///< unit normal, towards the vehicle
  double height = 0.0;                             ///< of the point O above it [m]
};

/// The plane through the hits of the first three beams; `p_BO` is the middle of the axle. Nothing if a range is not
/// finite, or the hits lie so close to one line that 4 mm of noise would turn the plane by more than 10 degrees.
[[nodiscard]] std::optional<GroundPlane> plane_through_hits(const std::vector<LaserBeam>& beams,
                                                            const Eigen::Vector3d& range, const Eigen::Vector3d& p_BO);

/// Slope of the ground as the vehicle stands on it.
struct Slope {
  double along = 0.0;   ///< in driving direction, uphill positive [rad]; the paper's eta (4)
  double across = 0.0;  ///< to its left, uphill positive [rad]
  Eigen::Matrix<double, 2, 5> J = Eigen::Matrix<double, 2, 5>::Zero();  ///< of (along, across) by (theta, delta)
};

/// For a vehicle whose axle points to y_W (left) on ground of normal n_W, both unit.
[[nodiscard]] Slope slope(const Eigen::Vector3d& y_W, const Eigen::Vector3d& n_W);

/// A beam's range on the ground at contact, linearized: range = predicted + H_normal delta + H_axle dp + offset. The
/// body's attitude does not appear: the normal's error is counted from it. Nor does the wheels' radius: the ground's
/// unevenness at the beams is not white, and must not be taken for an error of the radius.
struct BeamPrediction {
  double range = 0.0;  ///< [m]; not positive, or not finite, if the beam does not meet the ground
  Eigen::RowVector2d H_normal = Eigen::RowVector2d::Zero();
  Eigen::RowVector3d H_axle = Eigen::RowVector3d::Zero();
};

/// Range of a beam whose readings are `offset` too long [m], when the ground's plane passes the mean wheel radius below
/// O:
///   range = -(r + n_B . (p_BL - p_BO)) / (n_B . d_B) + offset
[[nodiscard]] BeamPrediction predict_range(const State& x, const Eigen::Matrix3d& R_WB, const LaserBeam& beam,
                                           double offset);

/// The wheels stand on the ground, so an axis of the odometer lies along it, linearized:
///   0 = lean + H_normal delta + H_odometer phi,   lean = axis_B . n_B
struct LeanPrediction {
  double lean = 0.0;  ///< sine of the axis' angle to the ground
  Eigen::RowVector2d H_normal = Eigen::RowVector2d::Zero();
  Eigen::RowVector3d H_odometer = Eigen::RowVector3d::Zero();
};

enum class OdometerAxis : std::uint8_t { forward, left };  ///< `left` is that of the axle

[[nodiscard]] LeanPrediction predict_lean(const State& x, const Eigen::Matrix3d& R_WB, OdometerAxis axis);

/// How fast the vehicle rises off the ground, linearized: climb = speed + H_normal delta + H_velocity nu,
/// speed = n . v. The attitude does not appear: errors of n and v are counted from it.
struct ClimbPrediction {
  double speed = 0.0;  ///< [m/s]
  Eigen::RowVector2d H_normal = Eigen::RowVector2d::Zero();
  Eigen::RowVector3d H_velocity = Eigen::RowVector3d::Zero();
};

[[nodiscard]] ClimbPrediction predict_climb(const State& x);

}  // namespace ear
