// Poses, velocities and covariances made by hand, in the axes of MAVLink.
#include <doctest/doctest.h>

#include <cmath>
#include <random>

#include "src/mavlink/odometry_message.h"

using namespace ear;
using namespace ear::mavlink;
using Eigen::AngleAxisd;
using Eigen::Matrix3d;
using Eigen::Vector3d;

namespace {

constexpr double kDegree = M_PI / 180.0;

const Matrix3d kUpright = mounting_of(0.0, 0.0, 0.0);  // the IMU's axes are x forward, y left, z up

/// Roll, pitch, yaw as flight controllers read them: yaw about z, then pitch about y, then roll about x [deg].
Vector3d roll_pitch_yaw_deg(const Eigen::Quaterniond& q) {
  const Matrix3d R = q.toRotationMatrix();
  return Vector3d(std::atan2(R(2, 1), R(2, 2)), -std::asin(R(2, 0)), std::atan2(R(1, 0), R(0, 0))) / kDegree;
}

NavState turned(double angle_deg, const Vector3d& axis) {
  NavState x;
  x.q_WB = AngleAxisd(angle_deg * kDegree, axis);
  return x;
}

bool near(const Vector3d& a, const Vector3d& b, double tolerance = 1e-9) { return (a - b).norm() < tolerance; }

Vector3d random_vector(std::mt19937_64& rng, double sigma) {
  std::normal_distribution<double> normal(0.0, sigma);
  return {normal(rng), normal(rng), normal(rng)};
}

Matrix3d random_rotation(std::mt19937_64& rng) {
  std::normal_distribution<double> normal;
  return Eigen::Quaterniond(normal(rng), normal(rng), normal(rng), normal(rng)).normalized().toRotationMatrix();
}

NavState random_state(std::mt19937_64& rng) {
  NavState x;
  x.t_ns = 1'000'000'000;
  x.q_WB = random_rotation(rng);
  x.p_WB = random_vector(rng, 5.0);
  x.v_W = random_vector(rng, 2.0);
  x.b_g = random_vector(rng, 0.05);
  return x;
}

EstimateCovariance random_covariance(std::mt19937_64& rng) {
  std::normal_distribution<double> normal;
  const EstimateCovariance A = EstimateCovariance::NullaryExpr([&](Eigen::Index, Eigen::Index) { return normal(rng); });
  return A * A.transpose();
}

/// The state with an error as estimate_error defines it.
NavState with_error(const NavState& x, const Eigen::VectorXd& e) {
  NavState y = x;
  const Vector3d rotation = e.segment<3>(estimate_error::rotation);
  if (rotation.norm() > 0.0) y.q_WB = AngleAxisd(rotation.norm(), rotation.normalized()) * x.q_WB;
  y.v_W += e.segment<3>(estimate_error::velocity);
  y.p_WB += e.segment<3>(estimate_error::position);
  y.b_g += e.segment<3>(estimate_error::gyro_bias);
  return y;
}

}  // namespace

TEST_CASE("mavlink odometry: at the origin, all is zero") {
  NavState x;
  x.t_ns = 1'234'567'890;
  const OdometryMessage m = make_odometry(x, Vector3d::Zero(), kUpright);
  CHECK(m.time_us == 1'234'567);
  CHECK(m.q_LV.isApprox(Eigen::Quaterniond::Identity()));
  CHECK(m.p_L.norm() == 0.0);
}

TEST_CASE("mavlink odometry: forward, left and up become x, -y and -z") {
  NavState x;
  x.p_WB = {1.0, 2.0, 3.0};
  CHECK(near(make_odometry(x, Vector3d::Zero(), kUpright).p_L, {1.0, -2.0, -3.0}));
}

TEST_CASE("mavlink odometry: a turn to the left is a negative yaw, nose down a negative pitch, left side up a roll") {
  const auto angles = [](const NavState& x) {
    return roll_pitch_yaw_deg(make_odometry(x, Vector3d::Zero(), kUpright).q_LV);
  };
  CHECK(near(angles(turned(90.0, Vector3d::UnitZ())), {0.0, 0.0, -90.0}));
  CHECK(near(angles(turned(20.0, Vector3d::UnitY())), {0.0, -20.0, 0.0}));  // REP-103: nose down is positive
  CHECK(near(angles(turned(20.0, Vector3d::UnitX())), {20.0, 0.0, 0.0}));
}

TEST_CASE("mavlink odometry: a vehicle that climbs has a negative z velocity") {
  NavState x = turned(-60.0, Vector3d::UnitZ());
  x.v_W = {0.0, 0.0, 0.7};
  CHECK(near(make_odometry(x, Vector3d::Zero(), kUpright).v_V, {0.0, 0.0, -0.7}));
}

TEST_CASE("mavlink odometry: the velocity is along the vehicle's axes") {
  NavState x = turned(90.0, Vector3d::UnitZ());
  x.v_W = {0.0, 2.0, 0.0};  // north of where it started, which is where it now looks
  CHECK(near(make_odometry(x, Vector3d::Zero(), kUpright).v_V, {2.0, 0.0, 0.0}));
  x.v_W = {1.0, 0.0, 0.0};  // to its right
  CHECK(near(make_odometry(x, Vector3d::Zero(), kUpright).v_V, {0.0, 1.0, 0.0}));
}

TEST_CASE("mavlink odometry: turning left is a negative yaw rate") {
  CHECK(near(make_odometry(NavState{}, {0.1, 0.2, 0.3}, kUpright).w_V, {0.1, -0.2, -0.3}));
}

TEST_CASE("mavlink odometry: the vehicle's axes do not depend on how the IMU is mounted") {
  std::mt19937_64 rng{11};
  const NavState upright = random_state(rng);  // of an IMU that is mounted straight
  const Vector3d rate = random_vector(rng, 1.0);
  const OdometryMessage expected = make_odometry(upright, rate, kUpright);

  const Vector3d rpy = Vector3d(180.0, -35.0, 130.0) * kDegree;
  const Matrix3d R_OB = (AngleAxisd(rpy.z(), Vector3d::UnitZ()) * AngleAxisd(rpy.y(), Vector3d::UnitY()) *
                         AngleAxisd(rpy.x(), Vector3d::UnitX()))
                            .toRotationMatrix();
  NavState crooked = upright;
  crooked.q_WB = upright.q_WB * Eigen::Quaterniond(R_OB);
  EncoderCalibration encoder;
  encoder.T_BO.linear() = R_OB.transpose();
  encoder.T_BO.translation() = Vector3d(0.1, 0.2, 0.3);
  for (const Matrix3d& R_BV : {mounting_of(rpy.x(), rpy.y(), rpy.z()), mounting_of(encoder)}) {
    const OdometryMessage m = make_odometry(crooked, R_OB.transpose() * rate, R_BV);
    CHECK(near(m.p_L, expected.p_L));
    CHECK(m.q_LV.angularDistance(expected.q_LV) < 1e-9);
    CHECK(near(m.v_V, expected.v_V));
    CHECK(near(m.w_V, expected.w_V));
  }
}

TEST_CASE("mavlink odometry: an uncertain forward position stays forward, and yaw is what grows") {
  EstimateCovariance P = EstimateCovariance::Zero();
  P(estimate_error::position, estimate_error::position) = 4.0;
  P(estimate_error::position + 1, estimate_error::position + 1) = 9.0;
  P(estimate_error::position, estimate_error::position + 1) =
      P(estimate_error::position + 1, estimate_error::position) = 2.0;
  P(estimate_error::rotation + 2, estimate_error::rotation + 2) = 0.25;
  const NavState x = turned(90.0, Vector3d::UnitZ());
  OdometryMessage m = make_odometry(x, Vector3d::Zero(), kUpright);
  set_covariances(m, x, P, 0.0, kUpright);
  CHECK(m.pose_covariance(0, 0) == doctest::Approx(4.0));
  CHECK(m.pose_covariance(1, 1) == doctest::Approx(9.0));
  CHECK(m.pose_covariance(0, 1) == doctest::Approx(-2.0));  // y is the other way round
  CHECK(m.pose_covariance(5, 5) == doctest::Approx(0.25));
  CHECK(m.pose_covariance(3, 3) == doctest::Approx(0.0));
}

TEST_CASE("mavlink odometry: what is uncertain along the world's x is sideways after a quarter turn") {
  EstimateCovariance P = EstimateCovariance::Zero();
  P(estimate_error::velocity, estimate_error::velocity) = 0.5;
  P(estimate_error::rotation, estimate_error::rotation) = 0.1;
  const NavState x = turned(90.0, Vector3d::UnitZ());
  OdometryMessage m = make_odometry(x, Vector3d::Zero(), kUpright);
  set_covariances(m, x, P, 0.04, kUpright);
  CHECK(m.velocity_covariance(0, 0) == doctest::Approx(0.0));
  CHECK(m.velocity_covariance(1, 1) == doctest::Approx(0.5));
  CHECK(m.pose_covariance(3, 3) == doctest::Approx(0.0));
  CHECK(m.pose_covariance(4, 4) == doctest::Approx(0.1));  // a tilt about the world's x is a pitch now
  CHECK(m.velocity_covariance.diagonal().tail<3>().isApprox(Vector3d::Constant(0.04)));
}

TEST_CASE("mavlink odometry: covariances are those of the message's own errors") {
  std::mt19937_64 rng{5};
  for (int trial = 0; trial < 20; ++trial) {
    CAPTURE(trial);
    const NavState x = random_state(rng);
    const Matrix3d R_BV = random_rotation(rng);
    const Vector3d gyro = random_vector(rng, 1.0);
    const OdometryMessage m = make_odometry(x, gyro - x.b_g, R_BV);

    // Numerical derivative of the message with respect to the estimate's error; rotations about the vehicle's axes.
    const auto errors = [&](const Eigen::VectorXd& e) -> Eigen::VectorXd {
      const NavState y = with_error(x, e);
      const OdometryMessage n = make_odometry(y, gyro - y.b_g, R_BV);
      const AngleAxisd turn(m.q_LV.conjugate() * n.q_LV);
      Eigen::VectorXd d(12);
      d << n.p_L - m.p_L, turn.angle() * turn.axis(), n.v_V - m.v_V, n.w_V - m.w_V;
      return d;
    };
    Eigen::Matrix<double, 12, estimate_error::size> J;
    for (int i = 0; i < estimate_error::size; ++i) {
      const Eigen::VectorXd step = 1e-6 * Eigen::VectorXd::Unit(estimate_error::size, i);
      J.col(i) = (errors(step) - errors(-step)) / 2e-6;
    }
    const EstimateCovariance P = random_covariance(rng);
    const Eigen::Matrix<double, 12, 12> expected = J * P * J.transpose();
    OdometryMessage with_covariances = m;
    set_covariances(with_covariances, x, P, 0.0, R_BV);
    CHECK(with_covariances.pose_covariance.isApprox(expected.topLeftCorner<6, 6>(), 1e-6));
    CHECK(with_covariances.velocity_covariance.isApprox(expected.bottomRightCorner<6, 6>(), 1e-6));
  }
}
