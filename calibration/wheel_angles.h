// The angles of both wheels at any time, from encoder readings.
#pragma once

#include <Eigen/Core>
#include <optional>
#include <vector>

#include "ear/calibration.h"
#include "ear/types.h"

namespace ear::calibration {

class WheelAngles {
 public:
  WheelAngles(const EncoderCalibration& encoder, const std::vector<EncoderSample>& samples);

  /// Left and right, since the first reading [rad], by IMU time and the encoder's `time_offset`. Nothing where there is
  /// no reading within 0.1 s on either side.
  [[nodiscard]] std::optional<Eigen::Vector2d> angle(TimeNs t_ns) const;
  /// How fast they turn [rad/s], over 40 ms.
  [[nodiscard]] std::optional<Eigen::Vector2d> speed(TimeNs t_ns) const;

 private:
  struct Reading {
    TimeNs t_ns;
    Eigen::Vector2d angle;
  };
  std::vector<Reading> readings_;
};

}  // namespace ear::calibration
