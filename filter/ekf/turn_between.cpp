#include "filter/ekf/turn_between.h"

#include <Eigen/Geometry>

namespace ear {

Eigen::Matrix3d turn_between(const Eigen::Vector3d& a, const Eigen::Vector3d& b) {
  return Eigen::Quaterniond::FromTwoVectors(a, b).toRotationMatrix();
}

}  // namespace ear
