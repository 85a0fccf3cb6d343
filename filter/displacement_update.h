// What a pre-integrated wheel displacement says about two poses: the paper's residual (12). docs/filter.md, section 10.
#pragma once

#include <Eigen/Core>

#include "filter/state.h"
#include "filter/wheel_preintegration.h"

namespace ear {

/// The displacement of O from clone i to now, measured less predicted, in B_i: residual = H e + n, cov(n) = covariance.
struct DisplacementRows {
  Eigen::Vector3d residual;                                                                 ///< [m]
  Eigen::Matrix<double, 3, err::camera> H = Eigen::Matrix<double, 3, err::camera>::Zero();  ///< all before err::camera
  Eigen::Matrix<double, 3, err::clone_size> H_clone;                                        ///< clone i
  Eigen::Matrix3d covariance;                                                               ///< [m^2]
};

/// The wheels as the filter knows them.
[[nodiscard]] WheelModel wheel_model(const OdometerState& odometer);

/// Linearizes the displacement `z` that was started at clone number `i`, with the ground's normal and the gyroscope's
/// bias of the state then, and ends now. What the state has learned since is taken in to first order. The rotation of
/// (12) is no row: the same gyroscope has already propagated the state.
[[nodiscard]] DisplacementRows linearize_displacement(const State& x, int i, const WheelDisplacement& z);

}  // namespace ear
