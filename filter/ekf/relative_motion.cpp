#include "filter/ekf/relative_motion.h"

#include "filter/ekf/so3.h"

namespace ear {

void linearize_relative_motion(const State& x, const Pose& T_B0B1, Eigen::Ref<Eigen::MatrixXd> H,
                               Eigen::Ref<Eigen::Matrix<double, 6, 1>> residual) {
  const Pose measured = x.clones.back().T_WB * T_B0B1;
  residual << log_so3(measured.R * x.imu.R_WB.transpose()), measured.p - x.imu.p_WB;
  H.setZero();
  H.block<3, 3>(0, err::theta).setIdentity();
  H.block<3, 3>(3, err::theta) = -skew(x.imu.p_WB);
  H.block<3, 3>(3, err::rho).setIdentity();
  auto H_clone = H.rightCols<err::clone_size>();
  H_clone.topLeftCorner<3, 3>() = -Eigen::Matrix3d::Identity();
  H_clone.bottomLeftCorner<3, 3>() = skew(x.imu.p_WB);  // as of the body: a turn of both moves nothing in the clone
  H_clone.bottomRightCorner<3, 3>() = -Eigen::Matrix3d::Identity();
}

}  // namespace ear
