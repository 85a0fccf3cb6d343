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

  /// An increment of wheels on the ground, the samples of that time, and the gyroscope's bias [rad/s].
  void add(const WheelIncrement& increment, const ImuBuffer& imu, const Eigen::Vector3d& b_g);

  /// Are both forwards more than 45 degrees apart, or do wheels and gyroscope turn against each other?
  [[nodiscard]] bool contradicts() const { return contradicts_; }

 private:
  /// Horizontal velocity that was gained since the last gap [m/s], forward and left.
  struct Gained {
    std::complex<double> inertial;   ///< by the specific force
    std::array<double, 2> wheels{};  ///< by the wheels: forward; left, for a yaw rate of the gyroscope
    Gained& add(const Gained& other, double weight);
  };
  /// Sums over windows, in which something changed: inertial = forward x0 + left x1.
  struct Regression {
    Eigen::Matrix2cd xx = Eigen::Matrix2cd::Zero();
    Eigen::Vector2cd xy = Eigen::Vector2cd::Zero();
    double yy = 0.0, count = 0.0;
  };
  /// Sums of the turns by the wheels (w) and by the gyroscope (g) [rad].
  struct Turns {
    double gg = 0.0, gw = 0.0, ww = 0.0, count = 0.0;
  };

  void restart(TimeNs t_ns);
  void close_window();
  [[nodiscard]] bool forwards_apart() const;
  [[nodiscard]] bool turns_apart() const;

  double still_;                 ///< [m/s] wheels that change less than that show nothing
  double radius_, track_width_;  ///< [m]
  Eigen::Matrix3d R_OB_;
  TimeNs end_ns_ = 0;
  double duration_ = 0.0;                             ///< [s] of the window at hand
  Eigen::Vector2d tilt_ = Eigen::Vector2d::Zero();    ///< [rad] about forward and left, since the last gap
  Eigen::Vector2d turned_ = Eigen::Vector2d::Zero();  ///< [rad] in the window: by the wheels, by the gyroscope
  Gained gained_, sum_;                               ///< now; integral over the window
  std::array<Gained, 2> means_;                       ///< over the two windows before
  int windows_ = 0;                                   ///< since the last gap
  Regression regression_;
  Turns turns_;
  bool contradicts_ = false;
};

}  // namespace ear
