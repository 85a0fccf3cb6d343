#include "filter/ekf/relative_motion.h"

#include "filter/ekf/so3.h"

namespace ear {

RelativeMotionRows linearize_relative_motion(const State& x, int i, const Pose& T_B0B1) {
  const Pose& from = x.clones[static_cast<std::size_t>(i)].T_WB;
  const Pose measured = {from.R * T_B0B1.R, from.p + from.R * T_B0B1.p};
  RelativeMotionRows rows;
  rows.residual.head<3>() = log_so3(measured.R * x.imu.R_WB.transpose());
  rows.residual.tail<3>() = measured.p - x.imu.p_WB;
  rows.H.block<3, 3>(0, err::theta).setIdentity();
  rows.H.block<3, 3>(3, err::theta) = -skew(x.imu.p_WB);
  rows.H.block<3, 3>(3, err::rho).setIdentity();
  rows.H_clone.topLeftCorner<3, 3>() = -Eigen::Matrix3d::Identity();
  rows.H_clone.bottomLeftCorner<3, 3>() = skew(measured.p);
  rows.H_clone.bottomRightCorner<3, 3>() = -Eigen::Matrix3d::Identity();
  return rows;
}

}  // namespace ear
