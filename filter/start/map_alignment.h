// Where the estimator's present world lies in the one that it started in: the two differ after it was lost and started
// again, by a turn about gravity and a shift that nothing can measure any more.
#pragma once

#include <Eigen/Core>

#include "ear/estimate.h"
#include "filter/ekf/propagation.h"
#include "filter/ekf/state.h"
#include "filter/ingest/imu_buffer.h"

namespace ear {

/// W: the world that the user knows; A: that of the filter since its last start. Both have z up.
struct MapAlignment {
  Eigen::Quaterniond q_WA = Eigen::Quaterniond::Identity();  ///< a turn about z
  Eigen::Vector3d p_WA = Eigen::Vector3d::Zero();            ///< [m]
  Eigen::Vector3d start_A = Eigen::Vector3d::Zero();         ///< where the vehicle was at that start [m]
  double yaw_sigma = 0.0;                                    ///< [rad]
  double position_sigma = 0.0;                               ///< [m] of start_A in W, each axis

  /// The vehicle as it was last known, in W, and how uncertain that became since: the vehicle `state_A` is now there.
  static MapAlignment join(const NavState& last_W, const NavState& state_A, double yaw_sigma, double position_sigma);

  /// The state goes on, but what it did since it was last known was contradicted: where it is, is known no better than
  /// after a start.
  void doubt(const NavState& last_W, TimeNs t_ns);

  [[nodiscard]] NavState to_world(const NavState& state_A) const;
  /// The covariance in W: turned, and with what is not known of the alignment itself. `state_A`: that of the estimate.
  [[nodiscard]] ImuErrorMatrix to_world(const ImuErrorMatrix& covariance_A, const NavState& state_A) const;
};

/// After a start that is not the first: the vehicle is where it was last known to be (`last`), less and less certainly;
/// the gyroscope shows how it turned since, if its samples reach back. `x`: the new start. `gyro_noise`
/// [rad/s/sqrt(Hz)].
[[nodiscard]] MapAlignment align_after_restart(const Estimate& last, const ImuState& x, const ImuBuffer& imu,
                                               double gyro_noise);

}  // namespace ear
