// What one recording brings to a calibration: all samples, and what the front end saw.
#pragma once

#include <string>
#include <vector>

#include "ear/estimate.h"
#include "ear/types.h"

namespace ear::calibration {

/// A position that something else measured.
struct ReferencePosition {
  TimeNs t_ns = 0;                              ///< IMU time
  Eigen::Vector3d p = Eigen::Vector3d::Zero();  ///< of the body, in a world of its own, z up [m]
};

/// Samples are in the order of time.
struct Drive {
  std::string name;  ///< for messages
  std::vector<ImuSample> imu;
  std::vector<EncoderSample> encoders;
  std::vector<LaserSample> lasers;
  std::vector<FeatureFrame> frames;  ///< by the lens of the calibration given
  std::vector<ReferencePosition> reference;
  double reference_sigma = 1.0;  ///< [m]
};

}  // namespace ear::calibration
