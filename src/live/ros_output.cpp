#include "src/live/ros_output.h"

#include <array>
#include <cmath>
#include <cstdio>

#include "src/health_text.h"
#include "src/ros2/outgoing.h"

namespace ear::live {
namespace {

using Matrix6d = Eigen::Matrix<double, 6, 6>;
using Matrix3x15d = Eigen::Matrix<double, 3, estimate_error::size>;

Eigen::Matrix3d skew(const Eigen::Vector3d& v) {
  Eigen::Matrix3d m;
  m << 0.0, -v.z(), v.y(), v.z(), 0.0, -v.x(), -v.y(), v.x(), 0.0;
  return m;
}

ros2::Vector3 vector_message(const Eigen::Vector3d& v) { return {v.x(), v.y(), v.z()}; }

/// P of two errors that are linear in the estimate's.
std::array<double, 36> covariance(const Matrix3x15d& first, const Matrix3x15d& second, const Estimate& estimate) {
  Eigen::Matrix<double, 6, estimate_error::size> H;
  H << first, second;
  const Matrix6d P = H * estimate.covariance * H.transpose();
  std::array<double, 36> rows{};
  for (int i = 0; i < 36; ++i) rows[static_cast<std::size_t>(i)] = P(i / 6, i % 6);
  return rows;
}

std::string number(double value) {
  std::array<char, 32> text{};
  std::snprintf(text.data(), text.size(), "%.6g", value);
  return text.data();
}

}  // namespace

ros2::Odometry RosMessages::odometry(const NavState& state, const Eigen::Vector3d& rate_B,
                                     const Estimate* estimate) const {
  const Eigen::Matrix3d R_WB = state.q_WB.toRotationMatrix();
  const Eigen::Matrix3d R_WR = R_WB * T_B_base_.linear();  // R: base_frame
  const Eigen::Vector3d lever_B = T_B_base_.translation();
  const Eigen::Vector3d lever_W = R_WB * lever_B;
  const Eigen::Vector3d v_W = state.v_W + R_WB * rate_B.cross(lever_B);

  ros2::Odometry message;
  message.header = {ros2::time_of_stamp(state.t_ns), names_.odom_frame};
  message.child_frame_id = names_.base_frame;
  message.pose.pose = ros2::pose_message(Eigen::Quaterniond(R_WR), state.p_WB + lever_W);
  message.twist.twist.linear = vector_message(R_WR.transpose() * v_W);
  message.twist.twist.angular = vector_message(T_B_base_.linear().transpose() * rate_B);
  if (estimate == nullptr) return message;

  namespace err = estimate_error;
  const Eigen::Matrix3d I = Eigen::Matrix3d::Identity();
  Matrix3x15d position = Matrix3x15d::Zero(), rotation = position, velocity = position, rate = position;
  position.middleCols<3>(err::position) = I;
  position.middleCols<3>(err::rotation) = -skew(lever_W);
  rotation.middleCols<3>(err::rotation) = I;
  velocity.middleCols<3>(err::velocity) = R_WR.transpose();
  velocity.middleCols<3>(err::rotation) = R_WR.transpose() * skew(state.v_W);  // the axes turn, too
  velocity.middleCols<3>(err::gyro_bias) = T_B_base_.linear().transpose() * skew(lever_B);
  rate.middleCols<3>(err::gyro_bias) = -T_B_base_.linear().transpose();
  message.pose.covariance = covariance(position, rotation, *estimate);
  message.twist.covariance = covariance(velocity, rate, *estimate);
  return message;
}

ros2::TfMessage RosMessages::frames(const Calibration& calibration, TimeNs t_ns) const {
  Calibration mounted = calibration;
  mounted.encoder.emplace().T_BO = T_B_base_;
  return ros2::static_frames(mounted, names_.base_frame, t_ns);
}

ros2::TfMessage RosMessages::transform(const ros2::Odometry& odometry) const {
  const ros2::Pose& pose = odometry.pose.pose;
  ros2::TransformStamped transform;
  transform.header = odometry.header;
  transform.child_frame_id = odometry.child_frame_id;
  transform.transform = {{pose.position.x, pose.position.y, pose.position.z}, pose.orientation};
  return {{transform}};
}

ros2::DiagnosticArray RosMessages::diagnostics(TimeNs t_ns, const Health& health, const std::string& rates) const {
  ros2::DiagnosticStatus status;
  switch (health.status) {
    case HealthStatus::tracking:
      status.level = ros2::DiagnosticStatus::kOk;
      break;
    case HealthStatus::lost:
      status.level = ros2::DiagnosticStatus::kError;
      break;
    default:
      status.level = ros2::DiagnosticStatus::kWarn;
  }
  status.name = "ear: localisation";
  status.message = to_text(health);
  status.values = {{"quality", std::to_string(health.quality)},
                   {"horizontal_sigma", number(health.horizontal_sigma)},
                   {"vertical_sigma", number(health.vertical_sigma)},
                   {"load_step", std::to_string(health.load_step)},
                   {"reset_counter", std::to_string(health.reset_counter)},
                   {"rates", rates}};
  for (std::size_t i = 0; i < kSourceCount; ++i) {
    if (health.faulty[i]) status.values.push_back({"faulty", kSourceNames[i]});
  }
  for (std::size_t i = 0; i < kSourceCount; ++i) {
    status.values.push_back({std::string("score ") + kSourceNames[i], number(health.sources[i].score)});
  }
  return {{ros2::time_of_stamp(t_ns), ""}, {status}};
}

const ros2::Path* RosPath::add(const ros2::Odometry& odometry) {
  const ros2::Point& at = odometry.pose.pose.position;
  if (!path_.poses.empty()) {
    const ros2::Point& last = path_.poses.back().pose.position;
    if (std::hypot(at.x - last.x, at.y - last.y, at.z - last.z) < kApart) return nullptr;
  }
  if (path_.poses.size() >= kMost) path_.poses.erase(path_.poses.begin());
  path_.poses.push_back({odometry.header, odometry.pose.pose});
  path_.header.stamp = odometry.header.stamp;
  return &path_;
}

}  // namespace ear::live
