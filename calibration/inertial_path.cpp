#include "calibration/inertial_path.h"

#include <algorithm>
#include <cmath>

#include "filter/ekf/state.h"

namespace ear::calibration {
namespace {

constexpr double kStrike = 10.0;   // [m/s^2] of the force, from one sample to the next
constexpr double kLongest = 0.05;  // [s] between two samples; more is a gap

ImuSample between(const ImuSample& a, const ImuSample& b, TimeNs t_ns) {
  const double share = seconds_between(a.t_ns, t_ns) / seconds_between(a.t_ns, b.t_ns);
  return {t_ns, a.gyro_B + share * (b.gyro_B - a.gyro_B), a.accel_B + share * (b.accel_B - a.accel_B)};
}

}  // namespace

std::vector<InertialPiece> pieces_between(const std::vector<ImuSample>& imu, TimeNs from_ns, TimeNs to_ns) {
  const auto later = [](TimeNs t_ns, const ImuSample& sample) { return t_ns < sample.t_ns; };
  auto next = std::upper_bound(imu.begin(), imu.end(), from_ns, later);
  if (next == imu.begin() || next == imu.end()) return {};
  std::vector<InertialPiece> pieces;
  for (TimeNs t_ns = from_ns; t_ns < to_ns; ++next) {
    if (next == imu.end()) return {};
    const ImuSample& a = *(next - 1);
    const ImuSample& b = *next;
    if (seconds_between(a.t_ns, b.t_ns) > kLongest) return {};
    const TimeNs end_ns = std::min(to_ns, b.t_ns);
    const ImuSample first = between(a, b, t_ns);
    const ImuSample last = between(a, b, end_ns);
    pieces.push_back({t_ns, seconds_between(t_ns, end_ns), 0.5 * (first.gyro_B + last.gyro_B),
                      0.5 * (first.accel_B + last.accel_B), (b.accel_B - a.accel_B).norm()});
    t_ns = end_ns;
  }
  return pieces;
}

Eigen::Matrix3d gyro_matrix(const GyroErrors& errors) {
  return Eigen::Matrix3d::Identity() + Eigen::Map<const Eigen::Matrix3d>(errors.data());
}

std::vector<InertialPiece> corrected(std::vector<InertialPiece> pieces, const Eigen::Matrix3d& matrix) {
  for (InertialPiece& piece : pieces) piece.gyro_B = matrix * piece.gyro_B;
  return pieces;
}

std::vector<PathNode> path_along(const std::vector<InertialPiece>& pieces, const NavState& from) {
  std::vector<PathNode> path;
  if (pieces.empty()) return path;
  const Eigen::Matrix3d R_KW = from.q_WB.toRotationMatrix().transpose();
  const Eigen::Vector3d gravity_k = R_KW * kGravity_W;
  PathNode node;
  node.t_ns = pieces.front().from_ns;
  node.v_kt = R_KW * from.v_W;
  for (const InertialPiece& piece : pieces) {
    node.rate_B = piece.gyro_B - from.b_g;
    path.push_back(node);
    const double dt = piece.dt;
    const Eigen::Vector3d f_B = piece.accel_B - from.b_a;
    const Eigen::Vector3d phi = node.rate_B * dt;
    node.J_p_ba += node.J_v_ba * dt - node.R_kt * gamma<2>(phi) * dt * dt;
    node.J_v_ba -= node.R_kt * gamma<1>(phi) * dt;
    node.p_kt += node.v_kt * dt + node.R_kt * gamma<2>(phi) * f_B * dt * dt + 0.5 * gravity_k * dt * dt;
    node.v_kt += node.R_kt * gamma<1>(phi) * f_B * dt + gravity_k * dt;
    node.R_kt = renormalized(node.R_kt * exp_so3(phi));
    node.t_ns += static_cast<TimeNs>(std::llround(1e9 * dt));
  }
  path.push_back(node);
  return path;
}

PathNode at(const std::vector<PathNode>& path, TimeNs t_ns) {
  const auto later = [](TimeNs time_ns, const PathNode& node) { return time_ns < node.t_ns; };
  auto next = std::upper_bound(path.begin(), path.end(), t_ns, later);
  PathNode node = next == path.begin() ? *next : *(next - 1);
  const double dt = seconds_between(node.t_ns, t_ns);
  node.t_ns = t_ns;
  node.p_kt += node.v_kt * dt;
  node.J_p_ba += node.J_v_ba * dt;
  node.R_kt = node.R_kt * exp_so3(node.rate_B * dt);
  return node;
}

Preintegrated preintegrated(const std::vector<InertialPiece>& pieces, const NavState& from, const GyroErrors& errors,
                            const ImuCalibration& noise) {
  namespace imu_error = smoother::imu_error;
  Preintegrated result{{from.b_g, from.b_a}, errors, Eigen::Matrix<double, 9, 9>::Zero()};
  smoother::ImuPreintegration& total = result.motion;
  Eigen::Matrix<double, 9, 9>& J = result.J_gyro;
  const Eigen::Matrix3d M = gyro_matrix(errors);
  for (const InertialPiece& piece : pieces) {
    ImuCalibration here = noise;
    if (piece.jump > kStrike) here.accel_noise = std::hypot(noise.accel_noise, 0.5 * piece.jump * std::sqrt(piece.dt));
    smoother::ImuPreintegration step(from.b_g, from.b_a);
    step.add(M * piece.gyro_B, piece.accel_B, piece.dt, here);

    // What was turned until here turns all that follows: Exp(xi) R and with it R dv, R dp of the step.
    const Eigen::Matrix3d R = total.R_BiBj();
    const auto xi = J.middleRows<3>(imu_error::xi);
    auto dv = J.middleRows<3>(imu_error::dv);
    auto dp = J.middleRows<3>(imu_error::dp);
    dp += dv * piece.dt - skew(R * step.dp_Bi()) * xi;
    dv -= skew(R * step.dv_Bi()) * xi;
    for (const int row : {imu_error::xi, imu_error::dv, imu_error::dp}) {
      const Eigen::Matrix3d by_rate = -R * step.J_bias().block<3, 3>(row, 0);
      for (int axis = 0; axis < 3; ++axis) J.block<3, 3>(row, 3 * axis) += piece.gyro_B(axis) * by_rate;
    }
    total.append(step);
  }
  return result;
}

}  // namespace ear::calibration
