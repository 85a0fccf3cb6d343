// The vehicle's motion as an explicit smooth function of time: what every simulated sensor samples.
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>

namespace ear::simulator {

/// Position of the axle's middle O [m] and its angles [rad]: R_WO = Rz(yaw) Rx(roll) Ry(pitch), nose-down pitch
/// positive.
using AxleState = Eigen::Matrix<double, 6, 1>;  // x, y, z, yaw, roll, pitch

/// Everything about the motion at one instant; derivatives are exact.
struct Kinematics {
  Eigen::Matrix3d R_WB;
  Eigen::Vector3d p_WB;     ///< [m]
  Eigen::Vector3d v_W;      ///< of the body's origin [m/s]
  Eigen::Vector3d a_W;      ///< of the body's origin [m/s^2]
  Eigen::Vector3d omega_B;  ///< angular rate of the body [rad/s]
  Eigen::Matrix3d R_WO;
  Eigen::Vector3d p_WO;     ///< middle of the axle [m]
  Eigen::Vector3d v_O_W;    ///< its velocity [m/s]
  Eigen::Vector3d omega_O;  ///< the same rotation as omega_B, in O
};

/// A uniform quintic B-spline (four continuous derivatives) over the axle's state.
/// The samples are its control points: the curve is the sampled motion, smoothed by the B-spline kernel (sigma 0.7
/// periods), which moves it by 0.25 period^2 times its acceleration: about a micrometre. All that is ever measured
/// comes from the curve itself, so truth and sensors agree exactly. Before the first and after the last sample it
/// stands still.
class Trajectory {
 public:
  /// states: one column per period, the first at time 0. T_BO: where the axle is on the body.
  Trajectory(double period, Eigen::Matrix<double, 6, Eigen::Dynamic> states, const Eigen::Isometry3d& T_BO);

  [[nodiscard]] Kinematics at(double t) const;
  [[nodiscard]] double period() const { return period_; }
  /// Time of the last sample [s].
  [[nodiscard]] double duration() const { return period_ * static_cast<double>(states_.cols() - 1); }

 private:
  double period_;
  Eigen::Matrix<double, 6, Eigen::Dynamic> states_;
  Eigen::Matrix3d R_OB_;
  Eigen::Vector3d p_OB_;
};

}  // namespace ear::simulator
