// How far the body goes until the next frame, once by the IMU and once by the wheels: what the consistency check
// compares with the camera. docs/anomaly.md.
#pragma once

#include <Eigen/Core>
#include <optional>

#include "ear/calibration.h"
#include "ear/filter_config.h"
#include "filter/consistency.h"
#include "filter/covariance.h"
#include "filter/imu_buffer.h"
#include "filter/ring.h"
#include "filter/state.h"
#include "filter/wheel_preintegration.h"
#include "filter/wheels.h"

namespace ear {

/// The IMU's samples from i to j, from the state at i on. Vectors are in B_i.
struct ImuMotion {
  double duration = 0.0;  ///< [s]
  Eigen::Vector3d p_BiBj = Eigen::Vector3d::Zero();
  Eigen::Matrix3d R_BiBj = Eigen::Matrix3d::Identity();
  Eigen::Matrix<double, 3, err::imu_size> H = Eigen::Matrix<double, 3, err::imu_size>::Zero();  ///< p by the error at i
  double position_variance = 0.0;  ///< of each axis, by the accelerometer's noise meanwhile [m^2]
  double rotation_variance = 0.0;  ///< of each axis, by the gyroscope's [rad^2]
};

/// Integrates the samples from x.t_ns to `to_ns`.
[[nodiscard]] ImuMotion imu_motion(const ImuState& x, const ImuBuffer& samples, TimeNs to_ns,
                                   const ImuCalibration& noise);

/// `P`: covariance of the error at i.
[[nodiscard]] Displacement imu_displacement(const ImuMotion& motion, const Covariance& P);

/// What the settings and the calibration, which has an encoder, say of the wheels' noise.
[[nodiscard]] WheelNoise wheel_noise(const OdometerConfig& odometer, const Calibration& calibration);

/// What the wheels' displacement needs to know beside the readings.
struct WheelSetting {
  WheelModel wheels;
  WheelNoise noise;
  double speed_sigma = 0.0;     ///< [m/s] in every direction
  double side_slip_turn = 0.0;  ///< [m/s per rad/s] along the axle
  bool on_plane = false;        ///< the ground is that of the state; else O's xy-plane
};

/// Turns of the wheels in time order: one that the state has passed, if there is one, and those to come.
class TurnsBetween {
 public:
  TurnsBetween(const std::optional<WheelIncrement>& passed, const Ring<WheelIncrement>& coming)
      : passed_(passed), coming_(coming) {}
  [[nodiscard]] std::size_t size() const { return coming_.size() + (passed_ ? 1 : 0); }
  [[nodiscard]] const WheelIncrement& operator[](std::size_t i) const {
    if (!passed_) return coming_[i];
    return i == 0 ? *passed_ : coming_[i - 1];
  }

 private:
  const std::optional<WheelIncrement>& passed_;
  const Ring<WheelIncrement>& coming_;
};

/// From x.imu.t_ns to `to_ns`. Readings do not come when frames do: a turn is shared out in proportion, the last one
/// goes on as it was. Not available where readings are missing or the vehicle lies on its side.
[[nodiscard]] Displacement wheel_displacement(const State& x, const Covariance& P, const TurnsBetween& turns,
                                              const ImuBuffer& samples, TimeNs to_ns, const WheelSetting& setting);

}  // namespace ear
