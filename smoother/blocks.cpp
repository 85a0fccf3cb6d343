#include "smoother/blocks.h"

namespace ear::smoother {

void set_imaging(const double* block, CameraState& cameras) {
  for (LensError& lens : cameras.lens_error) {
    lens.focal_length = block[0];
    lens.principal_point << block[1], block[2];
    block += err::lens_size;
  }
  cameras.time_offset = *block;
}

ImagingBlock imaging_block(const CameraState& cameras) {
  const auto& [left, right] = cameras.lens_error;
  return {left.focal_length,         left.principal_point.x(),  left.principal_point.y(), right.focal_length,
          right.principal_point.x(), right.principal_point.y(), cameras.time_offset};
}

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
