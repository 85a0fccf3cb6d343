#include "filter/sources/wheels/wheel_rows.h"

#include <doctest/doctest.h>

#include <random>

#include "tests/support/check_jacobian.h"
#include "tests/support/random_state.h"
#include "tests/support/state_error.h"

using namespace ear;
using namespace ear::test;

namespace {

constexpr double kRadius = 0.075;
constexpr double kTrackWidth = 0.4;

/// Standing at the origin, IMU above the axle.
State simple_state() {
  State x;
  x.odometer.wheel_radius.setConstant(kRadius);
  x.odometer.track_width = kTrackWidth;
  x.odometer.T_BO.p = {0.0, 0.0, -0.05};
  return x;
}

/// 10 ms in which the rims roll at these speeds over a body that does not pitch.
WheelIncrement rims(double left, double right) {
  WheelIncrement turn;
  turn.to_ns = 10'000'000;
  turn.angle = Eigen::Vector2d(left, right) * 0.01 / kRadius;
  return turn;
}

WheelRows rows_of(const State& x, const WheelIncrement& turn, const Eigen::Vector3d& gyro_B,
                  OdometerModel model = OdometerModel::terrain, bool normal_known = true) {
  return linearize_wheels(x, x.imu.R_WB, x.imu.v_W, turn, gyro_B, model, normal_known);
}

Eigen::Matrix3d pitched(double nose_down) { return exp_so3({0.0, nose_down, 0.0}); }

}  // namespace

TEST_CASE("wheels: straight on, all rows agree") {
  State x = simple_state();
  x.imu.v_W = {0.5, 0.0, 0.0};
  CHECK(rows_of(x, rims(0.5, 0.5), Eigen::Vector3d::Zero()).residual.norm() < 1e-12);
  CHECK(rows_of(x, rims(0.6, 0.6), Eigen::Vector3d::Zero()).residual(WheelRows::speed) == doctest::Approx(0.1));
}

TEST_CASE("wheels: a left turn has the right wheel ahead") {
  State x = simple_state();
  x.imu.v_W = {0.5, 0.0, 0.0};
  const double rate = 0.8;
  const WheelIncrement turn = rims(0.5 - 0.5 * kTrackWidth * rate, 0.5 + 0.5 * kTrackWidth * rate);
  CHECK(rows_of(x, turn, {0.0, 0.0, rate}).residual.norm() < 1e-12);
}

TEST_CASE("wheels: a nose-down swing on standing wheels turns the encoders back, and moves the IMU, not the axle") {
  State x = simple_state();
  const double rate = 0.7;              // nose-down is positive about y, to the left
  x.imu.v_W = {rate * 0.05, 0.0, 0.0};  // the IMU is above the axle and goes forward
  const WheelIncrement turn = rims(-rate * kRadius, -rate * kRadius);
  const WheelRows terrain = rows_of(x, turn, {0.0, rate, 0.0});
  CHECK(terrain.residual.norm() < 1e-12);
  CHECK(std::abs(terrain.wheel_speed) < 1e-12);
  const WheelRows planar = rows_of(x, turn, {0.0, rate, 0.0}, OdometerModel::gyro);
  CHECK(planar.residual(WheelRows::speed) == doctest::Approx(-rate * kRadius));
}

TEST_CASE("wheels: uphill the velocity goes up, whatever the body's pitch") {
  State x = simple_state();
  const double hill = 0.3;
  x.imu.R_WB = pitched(0.1);
  x.imu.v_W = 0.5 * Eigen::Vector3d(std::cos(hill), 0.0, std::sin(hill));
  x.ground.n_W = {-std::sin(hill), 0.0, std::cos(hill)};
  CHECK(rows_of(x, rims(0.5, 0.5), Eigen::Vector3d::Zero()).residual.norm() < 1e-12);
  const WheelRows planar = rows_of(x, rims(0.5, 0.5), Eigen::Vector3d::Zero(), OdometerModel::gyro);
  CHECK(std::abs(planar.residual(WheelRows::slope)) > 0.1);
}

TEST_CASE("wheels: the wheel that rolls and the gyroscope tell the speed when the other one stands") {
  State x = simple_state();
  x.imu.v_W = {0.5, 0.0, 0.0};
  const double rate = 0.8;
  const double left = 0.5 - 0.5 * kTrackWidth * rate, right = 0.5 + 0.5 * kTrackWidth * rate;
  WheelRows rows = rows_of(x, rims(0.0, right), {0.0, 0.0, rate});
  CHECK(std::abs(rows.residual(WheelRows::speed)) > 0.1);
  rows.measure_at(0.5 * kTrackWidth);
  CHECK(std::abs(rows.residual(WheelRows::speed)) < 1e-12);
  rows = rows_of(x, rims(left, 0.0), {0.0, 0.0, rate});
  rows.measure_at(-0.5 * kTrackWidth);
  CHECK(std::abs(rows.residual(WheelRows::speed)) < 1e-12);
}

TEST_CASE("wheels: the Jacobian of one wheel is the derivative, and knows nothing of the other's radius") {
  std::mt19937_64 rng{52};
  const WheelIncrement turn = rims(0.4, 0.55);
  const State x = random_state(rng, 0);
  const Eigen::Vector3d gyro_B = random_vector(rng, 0.5);
  const double lever = 0.5 * x.odometer.track_width;
  WheelRows rows = rows_of(x, turn, gyro_B, OdometerModel::gyro);
  rows.measure_at(lever);
  const auto prediction = [&](const Eigen::VectorXd& part) -> Eigen::VectorXd {
    Eigen::VectorXd d = Eigen::VectorXd::Zero(x.error_size());
    d.head(part.size()) = part;
    const State moved = with_error(x, d);
    const WheelRows both = rows_of(moved, turn, gyro_B, OdometerModel::gyro);
    return -Eigen::VectorXd::Constant(
        1, both.residual(WheelRows::speed) + 0.5 * moved.odometer.track_width * both.residual(WheelRows::yaw_rate));
  };
  Eigen::MatrixXd H = Eigen::MatrixXd::Zero(1, err::camera);
  H.rightCols<kGroundColumns>() = rows.H.row(WheelRows::speed);
  CHECK(std::abs(rows.H(WheelRows::speed, ground_column(err::wheel_radius))) < 1e-12);
  CHECK(rows.H(WheelRows::speed, ground_column(err::wheel_radius) + 1) != 0.0);
  check_jacobian(prediction, H);
}

TEST_CASE("wheels: Jacobians of every model are the derivatives") {
  std::mt19937_64 rng{51};
  WheelIncrement turn = rims(0.4, 0.55);
  for (const bool normal_known : {true, false}) {
    for (const OdometerModel model : {OdometerModel::terrain, OdometerModel::gyro}) {
      const State x = random_state(rng, 0);
      const Eigen::Vector3d gyro_B = random_vector(rng, 0.5);
      const WheelRows rows = rows_of(x, turn, gyro_B, model, normal_known);
      const auto prediction = [&](const Eigen::VectorXd& part) -> Eigen::VectorXd {
        Eigen::VectorXd d = Eigen::VectorXd::Zero(x.error_size());
        d.head(part.size()) = part;
        return -rows_of(with_error(x, d), turn, gyro_B, model, normal_known).residual;
      };
      // The attitude and the position do not appear, nor does the cameras' part.
      Eigen::MatrixXd H = Eigen::MatrixXd::Zero(WheelRows::size, err::camera);
      H.rightCols<kGroundColumns>() = rows.H;
      check_jacobian(prediction, H);
      const auto by_rate = [&](const Eigen::VectorXd& d) -> Eigen::VectorXd {
        return -rows_of(x, turn, gyro_B + d, model, normal_known).residual;
      };
      check_jacobian(by_rate, rows.J_gyro);
    }
  }
}

TEST_CASE("wheels: what readings are off by counts at both ends of a turn") {
  State x = simple_state();
  x.imu.v_W = {0.5, 0.0, 0.0};
  x.odometer.reading_error = {0.002, 0.003};  // at the beginning, at the end
  WheelRows rows = rows_of(x, rims(0.6, 0.6), Eigen::Vector3d::Zero());
  rows.count_readings(x.odometer, 1, 0.01);
  CHECK(std::abs(rows.residual(WheelRows::speed)) < 1e-12);
  const auto prediction = [&](const Eigen::VectorXd& d) -> Eigen::VectorXd {
    State moved = x;
    moved.odometer.reading_error += d;
    WheelRows there = rows_of(moved, rims(0.6, 0.6), Eigen::Vector3d::Zero());
    there.count_readings(moved.odometer, 1, 0.01);
    return -there.residual;
  };
  check_jacobian(prediction, rows.H.middleCols<2>(ground_column(err::readings)));
}

TEST_CASE("encoder reader: differences, wrap either way, cumulative counts") {
  EncoderCalibration calibration;
  calibration.resolution = 1000;
  EncoderReader wrapping(calibration);
  CHECK_FALSE(wrapping.add({0, 990, 10}));
  const auto forward_and_back = wrapping.add({10'000'000, 15, 985});
  REQUIRE(forward_and_back);
  CHECK(forward_and_back->angle.x() == doctest::Approx(2.0 * M_PI * 0.025));
  CHECK(forward_and_back->angle.y() == doctest::Approx(-2.0 * M_PI * 0.025));
  CHECK(forward_and_back->duration() == doctest::Approx(0.01));

  calibration.wraps = false;
  EncoderReader cumulative(calibration);
  CHECK_FALSE(cumulative.add({0, 0, 0}));
  CHECK(cumulative.add({10'000'000, 2500, 0})->angle.x() == doctest::Approx(2.0 * M_PI * 2.5));
}
