// Is forward, as the wheels roll, forward for the inertial sensors too, and left left? Axes that are exchanged or
// reversed leave an estimate that looks sound and is not. docs/health.md, "Mounting".
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstddef>

#include "ear/calibration.h"
#include "ear/filter_config.h"
#include "filter/ingest/imu_buffer.h"
#include "filter/ingest/wheel_increment.h"

namespace ear {

class MountingWatch {
 public:
  MountingWatch(const OdometerConfig& config, const EncoderCalibration& encoder);

  /// An increment of wheels on the ground, and the samples of that time. `b_g`: the gyroscope's bias [rad/s]; `up_B`:
  /// the unit vector upwards, with which a sequence of windows begins.
  void add(const WheelIncrement& increment, const ImuBuffer& imu, const Eigen::Vector3d& b_g,
           const Eigen::Vector3d& up_B);

  /// Are both forwards more than 45 degrees apart, or do wheels and gyroscope turn against each other?
  [[nodiscard]] bool contradicts() const { return contradicts_; }

 private:
  /// What is compared: horizontal velocity that was gained since the last gap [m/s], by the specific force, at the
  /// axle, and by the wheels, there to the left for a yaw rate of the gyroscope; yaw rates by wheels and gyroscope
  /// [rad/s].
  using Motion = Eigen::Matrix<double, 6, 1>;
  enum Entry : int { inertial_ahead, inertial_left, wheels_ahead, wheels_left, wheels_turn, gyro_turn };
  /// Sums over windows of the products of how it changed.
  struct Products {
    Eigen::Matrix<double, 6, 6> sum = Eigen::Matrix<double, 6, 6>::Zero();
    double count = 0.0;
    void add(const Motion& change, double kept);
  };

  void restart(TimeNs t_ns, const Eigen::Vector3d& up_B);
  void close_window();
  [[nodiscard]] bool forwards_apart() const;
  [[nodiscard]] bool turns_apart() const;

  OdometerConfig config_;
  double radius_, track_width_;  ///< [m]
  Eigen::Matrix3d R_OB_;
  Eigen::Vector3d p_OB_;                             ///< the inertial sensors in the odometer's frame [m]
  Eigen::Vector3d up_O_ = Eigen::Vector3d::UnitZ();  ///< as the gyroscope turns it: the state's would be made to fit
  TimeNs end_ns_ = 0;
  double duration_ = 0.0;                                                      ///< [s] of the window at hand
  Motion gained_ = Motion::Zero(), sum_ = Motion::Zero();                      ///< up to now; integral over the window
  std::array<Motion, 2> means_{Motion::Zero().eval(), Motion::Zero().eval()};  ///< over the two windows before
  int windows_ = 0;                                                            ///< since the last gap
  Products moved_;   ///< of windows in which the velocity changed
  Products turned_;  ///< of all
  bool contradicts_ = false;
};

}  // namespace ear
