#include "filter/sources/standstill/standstill.h"

#include "filter/ekf/relative_motion.h"

namespace ear {

Standstill::Standstill(const StandstillConfig& config, double focal_px, int window)
    : config_(config), detector_(config, focal_px), rows_(9, err::clone(window + 1)) {}

ImuStatistics Standstill::recent(const ImuBuffer& imu, TimeNs t_ns) const {
  return imu.statistics(t_ns - static_cast<TimeNs>(1e9 * config_.duration), t_ns);
}

bool Standstill::update(const Evidence& evidence) {
  const double max_gyro = evidence.b_g ? config_.max_gyro : config_.max_gyro_at_start;
  stands_ = detector_.update(evidence.frame, recent(evidence.imu, evidence.t_ns),
                             evidence.b_g.value_or(Eigen::Vector3d::Zero()), max_gyro,
                             evidence.on_ground ? wheel_rest_.duration(evidence.t_ns) : std::nullopt);
  return stands_;
}

void Standstill::hold(Ekf& ekf) {
  const State& state = ekf.state();
  const ImuState& x = state.imu;
  const int newest = static_cast<int>(state.clones.size()) - 1;
  const RelativeMotionRows rows = linearize_relative_motion(state, newest, Pose{});
  const int columns = err::clone(newest) + err::clone_size;
  Eigen::Matrix<double, 6, 1> weight;
  weight << Eigen::Vector3d::Constant(1.0 / config_.rotation_sigma),
      Eigen::Vector3d::Constant(1.0 / config_.position_sigma);
  auto H = rows_.topLeftCorner(9, columns);
  H.setZero();
  Eigen::Matrix<double, 9, 1> r;
  H.topLeftCorner<6, err::imu_size>() = weight.asDiagonal() * rows.H;
  H.topRightCorner<6, err::clone_size>() = weight.asDiagonal() * rows.H_clone;
  r.head<6>() = weight.asDiagonal() * rows.residual;
  H.block<3, 3>(6, err::theta) = -skew(x.v_W) / config_.velocity_sigma;
  H.block<3, 3>(6, err::nu) = Eigen::Matrix3d::Identity() / config_.velocity_sigma;
  r.segment<3>(6) = -x.v_W / config_.velocity_sigma;
  ekf.apply(H, 0, r, CameraUpdate::considered);
}

}  // namespace ear
