// What one recording brings to a calibration: all samples, what the front end saw, and a first guess of the motion.
#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include "ear/estimate.h"
#include "ear/types.h"

namespace ear::calibration {

/// A state that the filter estimated, and the image that was taken then.
struct DriveState {
  NavState state;
  TimeNs stamp_ns = 0;                       ///< of the image, by the camera's clock
  std::vector<FeatureObservation> features;  ///< by the calibration given; empty without an image
};

/// A position that something else measured.
struct ReferencePosition {
  TimeNs t_ns = 0;                              ///< IMU time
  Eigen::Vector3d p = Eigen::Vector3d::Zero();  ///< of the body, in a world of its own, z up [m]
};

struct Drive {
  std::string name;  ///< for messages
  std::vector<ImuSample> imu;
  std::vector<EncoderSample> encoders;
  std::vector<LaserSample> lasers;
  std::vector<DriveState> states;  ///< in the order of time, without gaps of more than a second
  std::vector<ReferencePosition> reference;
  double reference_sigma = 1.0;  ///< [m]
};

}  // namespace ear::calibration
