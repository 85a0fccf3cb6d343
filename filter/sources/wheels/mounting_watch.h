// Is forward, as the wheels roll, forward for the inertial sensors too, and left left? Axes that are exchanged or
// reversed leave an estimate that looks sound and is not. docs/health.md, "Mounting".
#pragma once

#include <Eigen/Core>
#include <array>
#include <complex>
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
  /// Horizontal velocity that was gained since the last gap [m/s], forward and left, and yaw rates [rad/s].
  struct Gained {
    std::complex<double> inertial;   ///< by the specific force, at the axle
    std::array<double, 2> wheels{};  ///< by the wheels: forward; left, for a yaw rate of the gyroscope
    std::array<double, 2> rates{};   ///< by the wheels; by the gyroscope
    Gained& add(const Gained& other, double weight);
  };
  /// Sums over windows, in which something changed: inertial = forward x0 + left x1.
  struct Regression {
    Eigen::Matrix2cd xx = Eigen::Matrix2cd::Zero();
    Eigen::Vector2cd xy = Eigen::Vector2cd::Zero();
    double yy = 0.0, count = 0.0;
  };
  /// Sums over the same windows of how the yaw rates by the wheels (w) and by the gyroscope (g) changed.
  struct Turns {
    double gg = 0.0, gw = 0.0, ww = 0.0, count = 0.0;
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
  double duration_ = 0.0;        ///< [s] of the window at hand
  Gained gained_, sum_;          ///< up to now; integral over the window
  std::array<Gained, 2> means_;  ///< over the two windows before
  int windows_ = 0;              ///< since the last gap
  Regression regression_;
  Turns turns_;
  bool contradicts_ = false;
};

}  // namespace ear
