#include "calibration/inertial_factor.h"

#include "smoother/factor.h"

namespace ear::calibration {

InertialFactor::InertialFactor(const Preintegrated& measured) : exact_(measured.motion), at_(measured.at) {
  J_gyro_ = -exact_.whitening().leftCols<9>() * measured.J_gyro;
}

bool InertialFactor::Evaluate(double const* const* blocks, double* residual, double** jacobians) const {
  using Errors = Eigen::Map<const Eigen::Matrix<double, 9, 1>>;
  if (!exact_.Evaluate(blocks, residual, jacobians)) return false;
  Eigen::Map<Eigen::Matrix<double, smoother::imu_error::size, 1>> r(residual);
  r += J_gyro_ * (Errors(blocks[4]) - Errors(at_.data()));
  if (jacobians != nullptr && jacobians[4] != nullptr) smoother::store(J_gyro_, jacobians[4]);
  return true;
}

}  // namespace ear::calibration
