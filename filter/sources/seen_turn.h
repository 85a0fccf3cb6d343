// How two stereo frames show the body to turn beyond what the gyroscope measured.
#pragma once

#include <Eigen/Core>

#include "ear/types.h"

namespace ear {

/// Vectors are in B.
struct SeenTurn {
  TimeNs t_ns = 0;                                     ///< of the later frame
  double duration = 0.0;                               ///< [s], more than 0
  Eigen::Vector3d rate_B = Eigen::Vector3d::Zero();    ///< the gyroscope's, the mean [rad/s]
  Eigen::Vector3d beyond_B = Eigen::Vector3d::Zero();  ///< by how much faster the images show it to be [rad/s]
  double variance = 1.0;                               ///< of that, one axis, by noise
};

}  // namespace ear
