#include "filter/start/start_moments.h"

#include <cmath>
#include <optional>
#include <utility>

#include "filter/ekf/so3.h"

namespace ear {

Eigen::Vector3d StartMoment::position(const StartFit::Vector& x) const {
  return t * x.segment<3>(StartFit::velocity) + 0.5 * t * t * x.segment<3>(StartFit::gravity) + sums.position + error;
}

StartFit::Rows StartMoment::position_by_state() const {
  StartFit::Rows J = StartFit::Rows::Zero();
  J.middleCols<3>(StartFit::velocity) = t * Eigen::Matrix3d::Identity();
  J.middleCols<3>(StartFit::gravity) = 0.5 * t * t * Eigen::Matrix3d::Identity();
  J.middleCols<3>(StartFit::gyro_bias) = sums.position_by_b_g;
  J.middleCols<3>(StartFit::accel_bias) = sums.position_by_b_a;
  J.col(StartFit::time_offset) = position_by_offset;
  return J;
}

/// Later by d, the sums from the first moment, with rate w and force f there, are those up to a later moment, without
/// what came before: turned by -w_0 d, less f_0 d of velocity.
std::vector<StartMoment> start_moments(const std::vector<TimeNs>& times, const StartFit::Vector& x,
                                       const ImuBuffer& imu) {
  const auto shifted = [&](TimeNs t_ns) { return later_by(x(StartFit::time_offset), t_ns); };
  std::vector<StartMoment> moments(times.size());
  StartSums sums;
  Eigen::Vector3d rate_B, force_B;
  std::optional<std::pair<Eigen::Vector3d, Eigen::Vector3d>> first;  // rate and force
  for (std::size_t k = 1; k < times.size(); ++k) {
    imu.for_each_piece(shifted(times[k - 1]), shifted(times[k]),
                       [&](const Eigen::Vector3d& gyro_B, const Eigen::Vector3d& accel_B, double dt) {
                         rate_B = gyro_B - x.segment<3>(StartFit::gyro_bias);
                         force_B = accel_B - x.segment<3>(StartFit::accel_bias);
                         if (!first) first = {rate_B, force_B};
                         sums.add(rate_B, force_B, dt);
                       });
    if (!first) break;
    StartMoment& moment = moments[k];
    moment.t = seconds_between(times.front(), times[k]);
    moment.sums = sums;
    moment.turn_by_offset = sums.R * rate_B - first->first;
    moment.position_by_offset = sums.velocity - moment.t * first->second - first->first.cross(sums.position);
  }
  return moments;
}

PointImage image_of(const Eigen::Vector3d& point, const StartFit::Vector& x, const StartMoment& moment,
                    const CameraState& cameras, int camera) {
  const Pose& T_BC = cameras.T_BC0;
  const Eigen::Matrix3d R_BC = exp_so3(x.segment<3>(StartFit::camera_rotation)) * T_BC.R;
  const Eigen::Matrix3d R_BkB = moment.sums.R.transpose();  // to the body at this moment
  const double inverse_depth = point.z();
  const Eigen::Vector3d shift = T_BC.p - moment.position(x);
  const Eigen::Vector3d direction = R_BC * point.head<2>().homogeneous();
  const Eigen::Vector3d y = direction + inverse_depth * shift;  // in B, from the body at this moment
  const Eigen::Vector3d h_C0 = R_BC.transpose() * (R_BkB * y - inverse_depth * T_BC.p);
  const Pose T_C0C = camera == 0
                         ? Pose{}
                         : Pose{exp_so3(x.segment<3>(StartFit::stereo_rotation)) * cameras.T_C0C1.R, cameras.T_C0C1.p};
  const Eigen::Vector3d from_C_C0 = h_C0 - inverse_depth * T_C0C.p;
  const Eigen::Vector3d h = T_C0C.R.transpose() * from_C_C0;
  PointImage image;
  image.depth = h.z();
  const Eigen::Vector2d uv = h.hnormalized();
  const Eigen::Vector3d lens = x.segment<3>(StartFit::lens_of(camera));
  image.uv = LensError{lens(0), lens.tail<2>()}.measured(uv);
  Eigen::Matrix<double, 2, 3> by_h;
  by_h << Eigen::Matrix2d::Identity(), -uv;
  by_h *= (1.0 + lens(0)) / h.z();
  const Eigen::Matrix<double, 2, 3> by_C0 = by_h * T_C0C.R.transpose();
  const Eigen::Matrix<double, 2, 3> by_body = by_C0 * R_BC.transpose();
  image.by_point << by_body * R_BkB * R_BC.leftCols<2>(), by_body * (R_BkB * shift - T_BC.p) - by_C0 * T_C0C.p;
  image.by_position = -inverse_depth * by_body * R_BkB;
  image.by_state = image.by_position * moment.position_by_state();
  image.by_turn = by_body * R_BkB * skew(y);
  image.by_state.middleCols<3>(StartFit::gyro_bias) += image.by_turn * moment.sums.R_by_b_g;
  image.by_state.col(StartFit::time_offset) += image.by_turn * moment.turn_by_offset;
  image.by_state.middleCols<3>(StartFit::camera_rotation) +=
      by_body * (skew(R_BkB * y) - R_BkB * skew(direction) - inverse_depth * skew(T_BC.p));
  image.by_state.middleCols<3>(StartFit::lens_of(camera)) << uv, Eigen::Matrix2d::Identity();
  if (camera == 1) image.by_state.middleCols<3>(StartFit::stereo_rotation) = by_C0 * skew(from_C_C0);
  return image;
}

/// The error of turn, velocity and position, all in B, from piece to piece; with it go its covariances with those
/// before.
Eigen::MatrixXd path_noise(const std::vector<TimeNs>& times, const StartFit::Vector& x, const ImuBuffer& imu,
                           const ImuCalibration& noise) {
  using Matrix9 = Eigen::Matrix<double, 9, 9>;
  const Eigen::Index size = StartMoment::errors_before(times.size());
  Eigen::MatrixXd covariance = Eigen::MatrixXd::Zero(size, size);
  Eigen::Matrix<double, Eigen::Dynamic, 9> earlier = Eigen::Matrix<double, Eigen::Dynamic, 9>::Zero(size, 9);
  Matrix9 P = Matrix9::Zero();
  StartSums sums;
  for (std::size_t k = 1; k < times.size(); ++k) {
    imu.for_each_piece(
        times[k - 1], times[k],
        [&](const Eigen::Vector3d& gyro_B, const Eigen::Vector3d& accel_B, double dt, const ImuNoiseFactors& factors) {
          const Eigen::Vector3d accel = accel_B - x.segment<3>(StartFit::accel_bias);
          const Eigen::Matrix3d by_turn = -skew(sums.R * accel);
          Matrix9 F = Matrix9::Identity();
          F.block<3, 3>(3, 0) = dt * by_turn;
          F.block<3, 3>(6, 0) = 0.5 * dt * dt * by_turn;
          F.block<3, 3>(6, 3) = dt * Eigen::Matrix3d::Identity();
          P = F * P * F.transpose();
          P.diagonal().head<3>().array() += dt * std::pow(factors.gyro * noise.gyro_noise, 2);
          P.diagonal().segment<3>(3).array() += dt * std::pow(factors.accel * noise.accel_noise, 2);
          earlier = earlier * F.transpose();
          sums.add(gyro_B - x.segment<3>(StartFit::gyro_bias), accel, dt);
        });
    const Eigen::Index at = StartMoment::errors_before(k);
    earlier.middleRows<3>(at) = P.topRows<3>();
    earlier.middleRows<3>(at + 3) = P.bottomRows<3>();
    for (const Eigen::Index part : {0, 3}) {  // turn and position
      const auto with_earlier = earlier.topRows(at + StartMoment::errors).middleCols<3>(2 * part);
      covariance.block(0, at + part, at + StartMoment::errors, 3) = with_earlier;
      covariance.block(at + part, 0, 3, at + StartMoment::errors) = with_earlier.transpose();
    }
  }
  return covariance;
}

}  // namespace ear
