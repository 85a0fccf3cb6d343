#include "smoother/blocks.h"

namespace ear::smoother {

bool PoseManifold::Plus(const double* x, const double* step, double* result) const {
  const Eigen::Quaterniond turn(exp_so3(Eigen::Map<const Eigen::Vector3d>(step)));
  const Eigen::Quaterniond q = (turn * Eigen::Map<const Eigen::Quaterniond>(x)).normalized();
  const Eigen::Vector3d p = Eigen::Map<const Eigen::Vector3d>(x + 4) + Eigen::Map<const Eigen::Vector3d>(step + 3);
  Eigen::Map<Eigen::Vector4d> rotation(result);
  rotation = q.coeffs();
  Eigen::Map<Eigen::Vector3d>(result + 4) = p;
  return true;
}

bool PoseManifold::PlusJacobian(const double* /*x*/, double* jacobian) const {
  Eigen::Map<Eigen::Matrix<double, 7, kPoseStep, Eigen::RowMajor>>(jacobian).setIdentity();
  return true;
}

bool PoseManifold::Minus(const double* y, const double* x, double* step) const {
  Eigen::Map<Eigen::Vector3d> theta(step);
  theta = log_so3(to_pose(y).R * to_pose(x).R.transpose());
  Eigen::Map<Eigen::Vector3d>(step + 3) =
      Eigen::Map<const Eigen::Vector3d>(y + 4) - Eigen::Map<const Eigen::Vector3d>(x + 4);
  return true;
}

bool PoseManifold::MinusJacobian(const double* /*x*/, double* jacobian) const {
  Eigen::Map<Eigen::Matrix<double, kPoseStep, 7, Eigen::RowMajor>>(jacobian).setIdentity();
  return true;
}

}  // namespace ear::smoother
