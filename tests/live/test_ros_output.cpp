// Poses and covariances of the vehicle's frame, against differences of states that are slightly wrong.
#include "src/live/ros_output.h"

#include <doctest/doctest.h>

#include <random>

using namespace ear;
using namespace ear::live;

namespace {

using Vector6d = Eigen::Matrix<double, 6, 1>;
using Errors = Eigen::Matrix<double, estimate_error::size, 1>;

Eigen::Quaterniond turned(const Eigen::Vector3d& angle) {
  return angle.norm() > 0.0 ? Eigen::Quaterniond(Eigen::AngleAxisd(angle.norm(), angle.normalized()))
                            : Eigen::Quaterniond::Identity();
}

/// Rotation vector from a to b, about fixed axes.
Eigen::Vector3d rotation_between(const ros2::Quaternion& a, const ros2::Quaternion& b) {
  const Eigen::Quaterniond q_a(a.w, a.x, a.y, a.z), q_b(b.w, b.x, b.y, b.z);
  const Eigen::AngleAxisd angle(q_b * q_a.conjugate());
  return angle.angle() * angle.axis();
}

Vector6d pose_difference(const ros2::Odometry& a, const ros2::Odometry& b) {
  const ros2::Point &p = a.pose.pose.position, &q = b.pose.pose.position;
  Vector6d d;
  d << q.x - p.x, q.y - p.y, q.z - p.z, rotation_between(a.pose.pose.orientation, b.pose.pose.orientation);
  return d;
}

Vector6d twist_difference(const ros2::Odometry& a, const ros2::Odometry& b) {
  const ros2::Twist &s = a.twist.twist, &t = b.twist.twist;
  Vector6d d;
  d << t.linear.x - s.linear.x, t.linear.y - s.linear.y, t.linear.z - s.linear.z, t.angular.x - s.angular.x,
      t.angular.y - s.angular.y, t.angular.z - s.angular.z;
  return d;
}

struct Case {
  RosMessages messages;
  Estimate estimate;
  Eigen::Vector3d gyro_B;
};

Case random_case() {
  std::mt19937_64 rng{5};
  std::normal_distribution<double> normal;
  const auto vector = [&] { return Eigen::Vector3d(normal(rng), normal(rng), normal(rng)); };
  Eigen::Isometry3d T_B_base = Eigen::Isometry3d::Identity();
  T_B_base.linear() = turned(vector()).toRotationMatrix();
  T_B_base.translation() = 0.3 * vector();
  Case c{RosMessages({}, T_B_base), {}, vector()};
  c.estimate.state = {1'700'000'000'000'000'000, turned(vector()), vector(), vector(), 0.1 * vector(), 0.1 * vector()};
  Eigen::Matrix<double, 15, 15> root;
  for (int i = 0; i < root.size(); ++i) root(i) = normal(rng);
  c.estimate.covariance = root * root.transpose();
  return c;
}

ros2::Odometry with_error(const Case& c, const Errors& e) {
  namespace err = estimate_error;
  NavState x = c.estimate.state;
  x.q_WB = turned(e.segment<3>(err::rotation)) * x.q_WB;
  x.v_W += e.segment<3>(err::velocity);
  x.p_WB += e.segment<3>(err::position);
  x.b_g += e.segment<3>(err::gyro_bias);
  return c.messages.odometry(x, c.gyro_B - x.b_g, nullptr);
}

}  // namespace

TEST_CASE("ros output: covariances are those of small errors, by numerical differentiation") {
  const Case c = random_case();
  constexpr double kStep = 1e-6;
  Eigen::Matrix<double, 6, estimate_error::size> pose, twist;
  for (int i = 0; i < estimate_error::size; ++i) {
    const Errors step = kStep * Errors::Unit(i);
    pose.col(i) = pose_difference(with_error(c, -step), with_error(c, step)) / (2.0 * kStep);
    twist.col(i) = twist_difference(with_error(c, -step), with_error(c, step)) / (2.0 * kStep);
  }
  const auto message = c.messages.odometry(c.estimate.state, c.gyro_B - c.estimate.state.b_g, &c.estimate);
  const Eigen::Matrix<double, 6, 6> P_pose = pose * c.estimate.covariance * pose.transpose();
  const Eigen::Matrix<double, 6, 6> P_twist = twist * c.estimate.covariance * twist.transpose();
  for (int i = 0; i < 36; ++i) {
    CAPTURE(i);
    CHECK(message.pose.covariance[static_cast<std::size_t>(i)] == doctest::Approx(P_pose(i / 6, i % 6)).epsilon(1e-5));
    CHECK(message.twist.covariance[static_cast<std::size_t>(i)] ==
          doctest::Approx(P_twist(i / 6, i % 6)).epsilon(1e-5));
  }
}

TEST_CASE("ros output: the velocity is that of the vehicle's frame, in its own axes") {
  Eigen::Isometry3d T_B_base = Eigen::Isometry3d::Identity();
  T_B_base.linear() = Eigen::AngleAxisd(M_PI, Eigen::Vector3d::UnitX()).toRotationMatrix();  // mounted upside down
  T_B_base.translation() = Eigen::Vector3d::UnitZ();
  NavState x;
  x.v_W = {1.0, 2.0, 3.0};
  const auto message = RosMessages({}, T_B_base).odometry(x, {0.0, 0.5, 0.0}, nullptr);
  CHECK(message.twist.twist.linear.x == doctest::Approx(1.5));  // and the lever's 0.5 m/s
  CHECK(message.twist.twist.linear.y == doctest::Approx(-2.0));
  CHECK(message.twist.twist.linear.z == doctest::Approx(-3.0));
  CHECK(message.twist.twist.angular.y == doctest::Approx(-0.5));
  CHECK(message.pose.pose.position.z == doctest::Approx(1.0));
}

TEST_CASE("ros output: the frames lead from base_link to the sensors, also without wheels") {
  Eigen::Isometry3d T_B_base = Eigen::Isometry3d::Identity();
  T_B_base.linear() = turned({0.1, -0.2, 0.3}).toRotationMatrix();
  T_B_base.translation() = Eigen::Vector3d(0.1, 0.2, -0.3);
  Calibration calibration;
  calibration.cameras.resize(1);
  calibration.cameras[0].T_BC.translation() = Eigen::Vector3d(0.05, 0.0, 0.02);
  const auto frames = RosMessages({}, T_B_base).frames(calibration, 1'700'000'000'000'000'000).transforms;
  REQUIRE(frames.size() == 2);
  CHECK(frames[0].header.frame_id == "base_link");
  CHECK(frames[0].child_frame_id == "imu0");
  CHECK(frames[1].header.frame_id == "imu0");
  CHECK(frames[1].child_frame_id == "cam0");
  const auto& [p, q] = frames[0].transform;  // takes coordinates of the IMU to base_link
  const Eigen::Vector3d zero =
      Eigen::Quaterniond(q.w, q.x, q.y, q.z) * T_B_base.translation() + Eigen::Vector3d(p.x, p.y, p.z);
  CHECK(zero.norm() < 1e-12);  // base_link's origin
  CHECK(frames[1].transform.translation.x == doctest::Approx(0.05));
}

TEST_CASE("ros output: the path grows with the way, and not without end") {
  RosPath path("odom");
  ros2::Odometry message;
  const ros2::Path* longest = path.add(message);
  REQUIRE(longest != nullptr);
  CHECK(path.add(message) == nullptr);
  for (int i = 0; i < 3000; ++i) {
    message.pose.pose.position.x += 0.06;
    longest = path.add(message);
    REQUIRE(longest != nullptr);
  }
  CHECK(longest->poses.size() == 1000);
  CHECK(longest->header.frame_id == "odom");
}

TEST_CASE("ros output: diagnostics say what the health is") {
  Health health;
  health.status = HealthStatus::degraded;
  health.faulty.set(index_of(Source::wheel_left));
  const auto message = RosMessages({}, Eigen::Isometry3d::Identity()).diagnostics(5'000'000'000, health, "imu 200 Hz");
  REQUIRE(message.status.size() == 1);
  CHECK(message.status[0].level.value == ros2::DiagnosticStatus::kWarn.value);
  CHECK(message.status[0].message.find("wheel_left") != std::string::npos);
  health.status = HealthStatus::lost;
  CHECK(RosMessages({}, Eigen::Isometry3d::Identity()).diagnostics(0, health, "").status[0].level.value ==
        ros2::DiagnosticStatus::kError.value);
}
