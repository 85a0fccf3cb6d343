// What the wheel encoders show of the body's velocity. The paper's (5)-(8); docs/filter.md, "Wheels".
#pragma once

#include <Eigen/Core>

#include "ear/filter_config.h"
#include "ear/types.h"
#include "filter/ekf/state.h"
#include "filter/ingest/wheel_increment.h"

namespace ear {

/// Rows of the odometer, linearized: each predicts zero, and residual = -prediction = H e + n.
struct WheelRows {
  static constexpr int speed = 0;     ///< along the ground, wheels against velocity [m/s]
  static constexpr int side = 1;      ///< along the axle [m/s]
  static constexpr int slope = 2;     ///< through the ground [m/s]
  static constexpr int yaw_rate = 3;  ///< wheels against gyroscope [rad/s]
  static constexpr int size = 4;

  Eigen::Matrix<double, size, 1> residual;
  Eigen::Matrix<double, size, kGroundColumns> H = Eigen::Matrix<double, size, kGroundColumns>::Zero();
  Eigen::Matrix<double, size, 3> J_gyro;  ///< of the prediction by the measured rate
  Eigen::Matrix3d direction;              ///< of speed, side and slope, in B
  double rim_speed = 0.0;                 ///< mean of both rims against the body [m/s]
  double wheel_speed = 0.0;               ///< forward speed that the wheels measure [m/s]

  /// What the state predicts in place of `wheel_speed` and of `rim_speed`, until the row of the speed is changed by one
  /// of the below [m/s].
  [[nodiscard]] double predicted_speed() const { return wheel_speed - residual(speed); }
  [[nodiscard]] double predicted_rim_speed() const { return rim_speed - residual(speed); }

  /// In place of the axle's middle, the speed is measured at this place on the axle, by the wheels and the gyroscope's
  /// yaw rate. `lever` [m]: half the track width is the right wheel alone, minus that the left one.
  void measure_at(double lever);

  /// The readings at both ends of the turn are off by what the state says of them; `last` is the index of that at its
  /// end, the other one is that at its beginning.
  void count_readings(const OdometerState& odometer, int last, double duration);
};

/// The odometer's rows at a state that is `v_W` and `R_WB` at the middle of the turn; `gyro_B`: mean measured rate over
/// the turn, bias included. With OdometerModel::terrain: (5) with the body's pitch rate, direction along the ground
/// (6)-(8); otherwise along the body, without it. `normal_known`: false without lasers: the ground is O's own xy-plane.
/// Derivatives by the directions are those at a velocity along the path, where the rows of side and slope are zero:
/// what the state's velocity has across is its error.
[[nodiscard]] WheelRows linearize_wheels(const State& x, const Eigen::Matrix3d& R_WB, const Eigen::Vector3d& v_W,
                                         const WheelIncrement& turn, const Eigen::Vector3d& gyro_B, OdometerModel model,
                                         bool normal_known);

/// What the row of the speed leaves out as it is linear, where the wheels' forward is the odometer's: the error of that
/// direction times that of the velocity. Its mean square [m^2/s^2], by the covariances of phi, of phi with nu, and of
/// nu.
[[nodiscard]] double speed_left_out(const Eigen::Matrix3d& R_WO, const Eigen::Matrix3d& phi,
                                    const Eigen::Matrix3d& phi_nu, const Eigen::Matrix3d& nu);

}  // namespace ear
