// How far the body goes until the next frame by the wheels, p^o of (13). docs/anomaly.md.
#pragma once

#include <Eigen/Core>

#include "ear/calibration.h"
#include "ear/filter_config.h"
#include "filter/ekf/covariance.h"
#include "filter/ekf/displacement.h"
#include "filter/ekf/state.h"
#include "filter/ingest/imu_buffer.h"
#include "filter/ingest/wheel_increment.h"
#include "filter/sources/wheels/wheel_preintegration.h"

namespace ear {

/// The wheels as the filter knows them.
[[nodiscard]] WheelModel wheel_model(const OdometerState& odometer);

/// The wheels' noise by the settings and the calibration.
[[nodiscard]] WheelNoise wheel_noise(const OdometerConfig& odometer, const EncoderCalibration& encoder,
                                     const ImuCalibration& imu);

/// What the wheels' displacement needs to know beside the readings.
struct WheelSetting {
  WheelNoise noise;
  double speed_sigma = 0.0;     ///< [m/s] in every direction
  double side_slip_turn = 0.0;  ///< [m/s per rad/s] along the axle
  bool on_plane = false;        ///< the ground is that of the state; else O's xy-plane
};

/// From x.imu.t_ns to `to_ns`. Not available where readings are missing or the vehicle lies on its side.
[[nodiscard]] Displacement wheel_displacement(const State& x, const Covariance& P, const WheelIncrements& increments,
                                              const ImuBuffer& samples, TimeNs to_ns, const WheelSetting& setting);

}  // namespace ear
