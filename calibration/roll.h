// From encoder readings and the inertial path between two keyframes to a RollModel.
#pragma once

#include <optional>
#include <vector>

#include "calibration/inertial_path.h"
#include "calibration/models.h"
#include "calibration/wheel_angles.h"

namespace ear::calibration {

/// How exact rolling is, beyond the encoders and the gyroscope.
struct RollNoise {
  double slip = 1e-3;       ///< of each wheel along its path [m/sqrt(m)]
  double side_slip = 2e-3;  ///< along the axle [m/sqrt(m)]
  double common = 0.0;      ///< of both wheels alike, besides [m/sqrt(m)]
};

/// What is the same for all intervals.
struct RollSetting {
  EncoderCalibration encoder;  ///< as given
  ImuCalibration imu;
  OdometerState given;  ///< the same as the encoder's
  OdometerState now;    ///< by the present parameters
  RollNoise noise;
};

/// The wheels as a calibration has them.
[[nodiscard]] OdometerState odometer_of(const EncoderCalibration& encoder);

/// From the path's first node to its last; `n_k`: the ground's normal, in the body at the first. Nothing where readings
/// are missing.
[[nodiscard]] std::optional<RollModel> roll_along(const std::vector<PathNode>& path, const Eigen::Vector3d& b_g,
                                                  const Eigen::Vector3d& n_k, const WheelAngles& angles,
                                                  const RollSetting& setting);

}  // namespace ear::calibration
